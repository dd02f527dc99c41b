"""The page, seen by browsers that connect to it."""

from dataclasses import asdict
import socket
import threading
from urllib.parse import urlsplit
from urllib.request import urlopen

from browser import browsing
from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check
from nodlidar_viewer.config import ViewerConfig
from nodlidar_viewer.controls import ADAPTS, Controls, PROFILE
from nodlidar_viewer.page import is_local, Page, web_address
from nodlidar_viewer.recent_points import RecentPoints
import numpy as np
import pytest

CLOUD = 'PointCloudMessage'
THIS_HOST = socket.gethostname()


@pytest.fixture
def page():
    controllers, opened = [], threading.Event()
    config = ViewerConfig(host='127.0.0.1', port=18_080)
    page = Page(config, lambda: ('', b''), opened.set, controllers.append)
    page.controllers, page.opened = controllers, opened
    yield page
    page.stop()


def test_the_widest_limits_of_a_nod_are_on_the_slider(page):
    nod = NodConfig(pitch_min=-1.6, pitch_max=1.6)
    check(nod)
    Controls(page, {**asdict(nod), ADAPTS: False, PROFILE: 'balanced'}, None)
    with browsing(page.address) as browser:
        browser.until(lambda: browser.of('GuiMultiSliderMessage'))
        shown = browser.of('GuiMultiSliderMessage')[0]['value']
    assert shown == pytest.approx([-91.673, 91.673], abs=1e-3)


@pytest.mark.parametrize('host', ['203.0.113.1', 'nowhere.invalid', '.'])
def test_a_host_that_is_not_this_machine_is_refused(host):
    with pytest.raises(ParameterError, match="'host' must be an address of this machine"):
        Page(ViewerConfig(host=host), lambda: ('', b''))


@pytest.mark.parametrize(
    ('host', 'shown'),
    [('127.0.0.1',) * 2, ('0.0.0.0', 'localhost'), ('::1', '[::1]'), ('::', '[::1]')],
)
def test_the_address_is_one_that_a_browser_opens(host, shown):
    assert web_address(host, 8080) == f'http://{shown}:8080'
    assert urlsplit(web_address(host, 8080)).port == 8080


def test_a_cloud_is_drawn_chunk_by_chunk(page):
    recent = RecentPoints(2500)
    with browsing(page.address) as browser:
        browser.until(page.opened.is_set)
        for number in range(4):
            recent.add(number * 10**9, np.full((1000, 3), float(number), dtype=np.float32))
            page.scene.show_cloud(recent.chunks)
            browser.until(lambda number=number: len(browser.of(CLOUD)) > number)
        kept = {message['name'] for message in browser.of(CLOUD)[-2:]}
        with browsing(page.address) as late:
            late.until(lambda: {m['name'] for m in late.of(CLOUD)} == kept)
        page.scene.show_cloud([])
        browser.until(lambda: kept <= {m['name'] for m in browser.of('RemoveSceneNodeMessage')})


def test_the_first_cloud_may_be_empty(page):
    recent = RecentPoints(2500)
    with browsing(page.address) as browser:
        browser.until(page.opened.is_set)
        for size in (0, 100):
            recent.add(size, np.full((size, 3), 9.0, dtype=np.float32))
            page.scene.show_cloud(recent.chunks)
        browser.until(lambda: any(len(m['props']['points']) for m in browser.of(CLOUD)))


def test_names_of_clouds_are_used_again(page):
    """The server keeps a message for each name that was removed while a browser looks."""
    recent, names = RecentPoints(2500), []
    for number in range(20):
        recent.add(number * 10**9, np.zeros((1000, 3), dtype=np.float32))
        page.scene.show_cloud(recent.chunks)
        with browsing(page.address) as browser:
            browser.until(lambda: len(browser.of(CLOUD)) == len(recent.chunks))
            names += [message['name'] for message in browser.of(CLOUD)]
    assert len(set(names)) == 2


def test_a_chunk_that_grows_is_changed_and_not_drawn_anew(page):
    recent = RecentPoints(2500)

    def grow():
        recent.add(len(recent.points), np.full((100, 3), 3.0, dtype=np.float32))
        with page.at_once():
            page.scene.show_cloud(recent.chunks)

    def drawn(browser):
        clouds = [m['props'] for m in browser.of(CLOUD)]
        changes = [m['updates'] for m in browser.of('SceneNodeUpdateMessage')]
        latest = {name: value for each in clouds + changes for name, value in each.items()}
        return len(clouds), *(len(latest.get(name, ())) // 3 for name in ('points', 'colors'))

    grow()
    with browsing(page.address) as browser:
        browser.until(lambda: drawn(browser) == (1, 100, 100))
        grow()
        browser.until(lambda: drawn(browser) == (1, 200, 200))
    with browsing(page.address) as late:
        late.until(lambda: drawn(late) == (1, 200, 200))


def test_a_browser_of_this_machine_may_control(page):
    with browsing(page.address) as browser:
        browser.until(lambda: page.controllers)
        assert page.is_watched
    assert page.opened.wait(1.0)


def test_a_page_of_another_site_only_looks(page):
    with browsing(page.address, Origin='http://evil.example') as browser:
        browser.until(page.opened.is_set)
        browser.until(lambda: browser.of('GuiDropdownMessage'))
        assert not page.controllers


@pytest.mark.parametrize(
    ('address', 'origin', 'host', 'local'),
    [
        ('127.0.0.1', 'http://localhost:8080', 'localhost:8080', True),
        ('::1', None, 'localhost:8080', True),
        ('::ffff:127.0.0.1', 'http://127.0.0.1:8080', '127.0.0.1:8080', True),
        ('127.0.0.1', 'http://other.example', 'localhost:8080', False),
        ('127.0.0.1', 'null', 'localhost:8080', False),
        ('::1', 'http://[::1]:8080', '[::1]:8080', True),
        ('127.0.1.1', f'http://{THIS_HOST}:8080', f'{THIS_HOST}:8080', True),
        ('127.0.0.1', 'http://rebound.example:8080', 'rebound.example:8080', False),
        ('127.0.0.1', 'http://192.168.1.7:8080', '192.168.1.7:8080', False),
        ('127.0.0.1', None, '[::1', False),
        ('127.0.0.1', None, None, False),
        ('192.168.1.7', 'http://robot:8080', 'robot:8080', False),
        ('::ffff:10.0.0.3', None, 'robot:8080', False),
    ],
)
def test_who_is_local(address, origin, host, local):
    assert is_local(address, origin, host) is local


def test_nobody_can_share_the_page_through_the_internet(page):
    assert page._server.request_share_url() is None
    assert b'<html' in urlopen(page.address).read().lower()
