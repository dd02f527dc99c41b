"""Bags of simulated sensors for tests."""

from nodlidar_common.bag_messages import STORE
from nodlidar_common.nod import Nod
from nodlidar_sim.bag import messages, TOPICS, write_bag
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.scene import load_scene
from rosbags.rosbag2 import StoragePlugin, Writer

START_NS = 1_700_000_000_000_000_000
NOD = Nod(-0.6136, 0.6136, 4001 * 0.1 / 1024, 4001, START_NS)


def recording(duration, scene='room', velocity=(0.0, 0.0)):
    """Return what the reference sensor publishes on a base that drives and turns."""
    scene = load_scene(scene, ideal=True).with_velocity(velocity)
    return simulate(scene, NOD, duration, start_ns=START_NS)


def write_messages(path, entries, storage=StoragePlugin.MCAP, compression=None):
    """Write (time [ns], topic, message or raw bytes), in the order given."""
    writer = Writer(path, version=9, storage_plugin=storage)
    if compression is not None:
        writer.set_compression(*compression)
    with writer:
        connections = {}
        for time_ns, topic, message in entries:
            kind = TOPICS.get(topic) or message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            raw = message if isinstance(message, bytes) else STORE.serialize_cdr(message, kind)
            writer.write(connections[topic], time_ns, raw)
    return path


def entries_of(simulated):
    """Return the messages of a recording in the order of their times."""
    return sorted(messages(simulated), key=lambda entry: entry[0])


__all__ = ['NOD', 'START_NS', 'entries_of', 'recording', 'write_bag', 'write_messages']
