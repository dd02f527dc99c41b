"""Files for the nodes' parameters."""

from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any
import weakref


def temporary_file(owner: Any, text: str) -> Path:
    """Write a file that is removed together with its owner, or when the interpreter ends."""
    with NamedTemporaryFile('w', prefix='launch_params_', suffix='.yaml', delete=False) as file:
        file.write(text)
    path = Path(file.name)
    weakref.finalize(owner, path.unlink, missing_ok=True)
    return path
