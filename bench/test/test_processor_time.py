"""The rows of the processor times, of given runs."""

from collections import Counter

from bench.cost import processor_time


def test_ratios_are_those_of_the_medians_to_the_first_set_up():
    def run(driver, publisher):
        return Counter(
            {'driver': driver, 'servo': 0.1, 'assembler': 0.2, 'robot_state_publisher': publisher}
        )

    before = [run(0.1, 0.6), run(0.3, 0.0), run(0.1, 9.0)]  # 1.0, 0.6 and 9.4; without: 0.4, 0.6
    after = [run(0.0, 0.2), run(0.0, 0.1), run(7.0, 0.2)]  # 0.5, 0.4 and 7.5; without: 0.3, 7.3
    rows = processor_time.rows({'before': before, 'after': after})
    assert [row['set-up'] for row in rows] == ['before', 'after']
    assert [row['ratio'] for row in rows] == [1.0, 0.5]
    assert [round(row['ratio without it'], 9) for row in rows] == [1.0, 0.75]
    assert rows[1]['all nodes [%]'] == 50.0
    assert rows[0]['robot_state_publisher [%]'] == 60.0
