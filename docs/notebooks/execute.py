"""Execute the notebooks again and keep their outputs: ``python docs/notebooks/execute.py``.

They run in a temporary folder, so that what they write does not stay here. Needs nbclient and ipykernel, which
mkdocs-jupyter brings.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import nbformat
from nbclient import NotebookClient

HERE = Path(__file__).parent
ROOT = f"{HERE.parents[1]}/"  # demonstration logs lie in this clone, wherever it is: a report has their full paths


def execute(path: Path) -> None:
    """Execute one notebook and write it back with its outputs."""
    notebook = nbformat.read(path, as_version=4)
    with TemporaryDirectory() as folder:
        NotebookClient(notebook, timeout=600, resources={"metadata": {"path": folder}}).execute()
    for cell in notebook.cells:
        cell.metadata.clear()  # times, which differ with every execution
    notebook.metadata["language_info"] = {"name": "python"}
    path.write_text(nbformat.writes(notebook).replace(ROOT, "") + "\n", encoding="utf-8")


if __name__ == "__main__":
    for file in sorted(HERE.glob("*.ipynb")):
        execute(file)
        print(f"{file.relative_to(HERE)}  {file.stat().st_size / 1000.0:.0f} kB")
