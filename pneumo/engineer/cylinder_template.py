"""`pneumo init`: a commented configuration to edit."""

from pathlib import Path

from pneumo.errors import InputError
from pneumo.storage.files import write_text

TEMPLATE = Path(__file__).parent / "templates" / "cylinder.yaml"


def write_template(file: Path) -> None:
    """Write the template; `InputError` if the file is there already, or cannot be written."""
    if file.exists() or file.is_symlink():
        raise InputError(f"{file}: is there already, so left alone; name another file")
    try:
        write_text(TEMPLATE.read_text(encoding="utf-8"), file)
    except OSError as error:
        raise InputError(f"{file}: cannot be written ({error.strerror})") from None
