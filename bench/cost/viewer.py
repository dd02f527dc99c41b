"""The page of the viewer in Chromium without a graphics card, beside the simulated sensor."""

import asyncio
from pathlib import Path
import re
import tempfile
import time

from nodlidar_bringup.ros.launched import keep_apart, launched_sensor
from nodlidar_viewer.config import ViewerConfig
import psutil

from bench.cost.chromium import chromium
from bench.shared.node_processes import node_processes, seconds_of
from bench.shared.report import Row

SETTLING, DURATION = 12.0, 20.0  # until most_points are shown; of the measurement [s]
TITLE = f'The page in Chromium without a graphics card, {DURATION:.0f} s'
PICTURE = Path('viewer.png')
CLOSE_NOTICE = (  # that there is no graphics card
    "document.querySelector('.mantine-Notification-closeButton').click()"
)
_ADDRESS = re.compile(r'open (http\S+) in a browser')


def results() -> list[Row]:
    """Return when the first points are drawn, pictures per second and the cost of the node."""
    keep_apart()
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / 'launch.log'
        with launched_sensor(log, 'view:=web', 'ideal:=true') as sensor:
            address = _address(log)
            time.sleep(SETTLING)  # the launch has settled
            node = node_processes(sensor.process.pid, ['viewer'])['viewer']
            return [asyncio.run(_measure(address, node))]


async def _measure(address: str, node: psutil.Process) -> Row:
    idle = await _load(node)
    async with chromium() as tab:
        await tab.open(address)
        await asyncio.sleep(SETTLING)
        before = await tab.value('window.pictures')
        load = await _load(node)
        drawn = await tab.value('window.pictures') - before
        await tab.value(CLOSE_NOTICE)
        await tab.save_picture(PICTURE)
        first = await tab.value('window.firstPoints')
        hosts = tab.hosts - {'localhost', '127.0.0.1'}
    return {
        'points': ViewerConfig.most_points,
        'first points after [s]': first / 1000.0,
        'pictures per second': drawn / DURATION,
        'CPU of the viewer [%]': load,
        'CPU while nobody looks [%]': idle,
        'requests to other hosts': len(hosts),
    }


async def _load(node: psutil.Process) -> float:
    """Return the share of a core that a process uses [%]."""
    before = seconds_of(node)
    await asyncio.sleep(DURATION)
    return (seconds_of(node) - before) / DURATION * 100.0


def _address(log: Path) -> str:
    """Return the address that the launch prints."""
    deadline = time.monotonic() + 30.0
    while time.monotonic() < deadline:
        if found := _ADDRESS.search(log.read_text()):
            return found[1]
        time.sleep(0.1)
    raise TimeoutError(log.read_text())
