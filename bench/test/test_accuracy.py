"""The headline is what a user gets: its runs have the nod of the default parameters."""

from nodlidar_assembler.config import AssemblerConfig
import numpy as np
import pytest

from bench.shared.reference import real_room, simulated_room
from bench.shared.report import recorded, RESULTS

DEFAULT = AssemblerConfig()
README = RESULTS.parent.parent / 'README.md'


def test_readme_and_record_name_the_default_nod():
    section = README.read_text().split('## Accuracy and cost')[1].split('<!-- bench')[0]
    assert f'N_s = {DEFAULT.samples_per_sweep},' in section
    assert f'N_s = {DEFAULT.samples_per_sweep},' in recorded('accuracy')['title']


@pytest.mark.parametrize('room', [simulated_room, real_room])
def test_the_room_is_scanned_by_the_default_nod(room):
    """A sweep takes N_s beam periods of 1/10240 s; a real servo passes its limits a little."""
    recording = room(4.0)
    pitch, times_ns = recording.true_encoder_pitch.ravel(), recording.true_time_ns.ravel()
    lower = pitch.min() + 0.2 * np.ptp(pitch)
    rises = times_ns[1:][(pitch[:-1] < lower) & (pitch[1:] >= lower)]
    sweeps = np.diff(rises).mean() * 1e-9 / 2
    assert sweeps == pytest.approx(DEFAULT.samples_per_sweep / 10240, rel=0.01)
    assert np.ptp(pitch) == pytest.approx(DEFAULT.pitch_max - DEFAULT.pitch_min, rel=0.1)
