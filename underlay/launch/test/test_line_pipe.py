import asyncio
import os

from launch.line_pipe import LinePipe


def test_what_is_left_at_the_end_is_read():
    lines = []

    async def write_and_leave():
        with LinePipe(lines.append) as pipe:
            os.write(pipe.end, b'one\n\ntwo')

    asyncio.run(write_and_leave())
    assert lines == ['one', '', 'two']


def test_lines_and_characters_may_come_in_parts():
    lines = []

    async def write_in_parts():
        with LinePipe(lines.append) as pipe:
            for part in (b'caf', b'\xc3', b'\xa9 \xff', b'\n'):
                os.write(pipe.end, part)
                pipe._read()

    asyncio.run(write_in_parts())
    assert lines == ['café \ufffd']
