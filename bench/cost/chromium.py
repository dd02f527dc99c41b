"""Chromium without a screen or a graphics card, driven by its DevTools protocol."""

import asyncio
import base64
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
import itertools
import json
from pathlib import Path
import shutil
import subprocess
import tempfile
from typing import Any
from urllib.parse import urlsplit
from urllib.request import urlopen

from nodlidar_common.errors import NodlidarError
from websockets.asyncio.client import ClientConnection, connect

SIZE = (1280, 720)
# Counts the pictures that WebGL draws, and notes when the first cloud of points is drawn.
# The time of the document stands still while a picture is made. An animation frame of our own
# does not tell them apart: whether it comes before or after the page's is up to the page.
COUNTER = """
window.pictures = 0; window.firstPoints = null;
let latest = null;
const POINTS = 0;
const CALLS = ['drawArrays', 'drawElements', 'drawArraysInstanced', 'drawElementsInstanced'];
for (const name of CALLS) {
  const draw = WebGL2RenderingContext.prototype[name];
  WebGL2RenderingContext.prototype[name] = function (...given) {
    const count = name === 'drawArrays' ? given[2] : given[1];
    if (given[0] === POINTS && count > 100 && window.firstPoints === null)
      window.firstPoints = performance.now();
    const time = document.timeline.currentTime;
    if (time !== latest) { latest = time; window.pictures++; }
    return draw.apply(this, given);
  };
}
"""


class Tab:
    """One page in Chromium.

    Attributes
    ----------
    hosts
        To which the page has sent requests.
    """

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection
        self._numbers = itertools.count()
        self._answers: dict[int, asyncio.Future[Any]] = {}
        self.hosts: set[str] = set()

    async def listen(self) -> None:
        """Take answers and events until the connection ends."""
        async for text in self._connection:
            message = json.loads(text)
            if 'id' in message:
                self._answers.pop(message['id']).set_result(message.get('result'))
            elif message['method'] == 'Network.requestWillBeSent':
                url = urlsplit(message['params']['request']['url'])
                if url.scheme in ('http', 'https', 'ws', 'wss'):
                    self.hosts.add(url.hostname or '')

    async def call(self, method: str, **params: Any) -> Any:
        """Call a method of the protocol."""
        number = next(self._numbers)
        self._answers[number] = asyncio.get_running_loop().create_future()
        call = {'id': number, 'method': method, 'params': params}
        await self._connection.send(json.dumps(call))
        return await self._answers[number]

    async def open(self, address: str) -> None:
        """Open a page, and count its pictures."""
        await self.call('Page.enable')
        await self.call('Network.enable')
        await self.call('Page.addScriptToEvaluateOnNewDocument', source=COUNTER)
        await self.call('Page.navigate', url=address)

    async def value(self, expression: str) -> Any:
        """Return the value of a JavaScript expression."""
        answer = await self.call('Runtime.evaluate', expression=expression, returnByValue=True)
        return answer['result'].get('value')

    async def save_picture(self, path: Path) -> None:
        """Save what the page looks like."""
        answer = await self.call('Page.captureScreenshot')
        path.write_bytes(base64.b64decode(answer['data']))


@asynccontextmanager
async def chromium() -> AsyncIterator[Tab]:
    """Run Chromium with an empty page.

    Raises
    ------
    NodlidarError
        If it is not installed.
    """
    program = shutil.which('chromium') or shutil.which('google-chrome')
    if program is None:
        raise NodlidarError('this measurement needs Chromium: apt install chromium')
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        options = ['--headless=new', '--no-sandbox', '--use-angle=swiftshader']
        options += ['--enable-unsafe-swiftshader', '--remote-debugging-port=0']
        options += [f'--user-data-dir={profile}', f'--window-size={SIZE[0]},{SIZE[1]}']
        command = [program, *options, 'about:blank']
        with subprocess.Popen(command, stderr=subprocess.DEVNULL) as process:
            try:
                async with connect(await _page_of(Path(profile)), max_size=None) as connection:
                    tab = Tab(connection)
                    listening = asyncio.create_task(tab.listen())
                    yield tab
                    listening.cancel()
            finally:
                process.terminate()


async def _page_of(profile: Path) -> str:
    """Return the address of the first page, once Chromium has opened its port."""
    file = profile / 'DevToolsActivePort'
    while not (file.exists() and file.read_text().count('\n')):
        await asyncio.sleep(0.05)
    port = file.read_text().split('\n')[0]
    with urlopen(f'http://127.0.0.1:{port}/json') as answer:
        pages = json.load(answer)
    return next(str(page['webSocketDebuggerUrl']) for page in pages if page['type'] == 'page')
