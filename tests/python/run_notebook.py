"""Runs a notebook from top to bottom; its pictures go to a folder.

python run_notebook.py NOTEBOOK FOLDER

Fails where a cell does.
"""

import base64
import sys
from pathlib import Path

import nbclient
import nbformat

notebook, folder = Path(sys.argv[1]), Path(sys.argv[2])
folder.mkdir(parents=True, exist_ok=True)
document = nbformat.read(notebook, as_version=4)
nbclient.NotebookClient(document, timeout=600, resources={"metadata": {"path": folder}}).execute()
pictures = [
    output["data"]["image/png"]
    for cell in document.cells
    for output in cell.get("outputs", [])
    if "image/png" in output.get("data", {})
]
for ix, picture in enumerate(pictures):
    (folder / f"{notebook.stem}_{ix}.png").write_bytes(base64.b64decode(picture))
nbformat.write(document, folder / notebook.name)
if len(pictures) != 2:
    sys.exit(f"{notebook}: {len(pictures)} pictures, not those of the lights and of the hair")
print(f"{notebook}: {len(document.cells)} cells, {len(pictures)} pictures in {folder}")
