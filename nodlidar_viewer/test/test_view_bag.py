"""What the command view_bag tells of a bag."""

from dataclasses import replace

from nodlidar_assembler.bags.bag_topics import Topics
from nodlidar_common.nod import Nod
from nodlidar_sim.bag import write_bag
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.scene import load_scene
from nodlidar_viewer.commands.view_bag import _clouds_of

NOD = Nod(-0.6, 0.6, 4001 * 0.1 / 1024, 4001, 10**18)


def test_why_there_is_no_odometry_is_told(tmp_path, capsys):
    write_bag(simulate(load_scene('wall'), NOD, 1.0, start_ns=10**18), tmp_path / 'bag')
    frame, clouds = _clouds_of(tmp_path / 'bag', None, Topics())
    assert (frame, capsys.readouterr().err) == ('odom', '')
    frame, clouds = _clouds_of(tmp_path / 'bag', None, Topics(tf='/robot/tf'))
    assert frame == 'nodlidar_base_link'
    assert clouds
    assert 'without odometry: ' in (told := capsys.readouterr().err)
    assert '/robot/tf' in told


def test_transforms_that_could_not_be_used_are_told(tmp_path, capsys):
    recording = simulate(load_scene('wall'), NOD, 1.0, start_ns=10**18)
    stamps_ns = recording.odometry_stamp_ns.copy()
    stamps_ns[3:5] = 0
    write_bag(replace(recording, odometry_stamp_ns=stamps_ns), tmp_path / 'bag')
    frame, _ = _clouds_of(tmp_path / 'bag', None, Topics())
    assert frame == 'odom'
    assert 'dropped: 2 transform without a stamp on /tf' in capsys.readouterr().err
