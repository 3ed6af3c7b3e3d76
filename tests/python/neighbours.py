"""Imports jfpx before other extension modules, which must then work as without jfpx.

A wheel links the C++ run-time library statically. If it exported these symbols, modules that are loaded
later would use some of them instead of those of their own library. Packages that are not installed are
left out. Usage: PYTHONPATH=FOLDER_OF_JFPX python neighbours.py [--require N]
"""
import argparse
import importlib.util
import subprocess
import sys
import tempfile

PROGRAMS = {
    "torch": """
import torch
try:
    torch.zeros(2)[5]
except IndexError as error:
    print(error)
print(torch.jit.script(torch.nn.Linear(2, 2)).code)
""",
    "vtk": """
import vtk
writer = vtk.vtkXMLPolyDataWriter()
writer.SetFileName("sphere.vtp")
writer.SetDataModeToAscii()
source = vtk.vtkSphereSource()
writer.SetInputConnection(source.GetOutputPort())
writer.Write()
reader = vtk.vtkXMLPolyDataReader()
reader.SetFileName("sphere.vtp")
reader.Update()
print(reader.GetOutput().GetNumberOfPoints(), "points")
""",
    "rdkit": """
from rdkit import Chem
print(len(Chem.MolToMolBlock(Chem.MolFromSmiles("c1ccccc1"))))
""",
    "onnxruntime": """
import onnxruntime
try:
    onnxruntime.InferenceSession(b"bad")
except Exception as error:
    print(type(error).__name__)
""",
    "openmm": """
import openmm
text = openmm.XmlSerializer.serialize(openmm.System())
print(openmm.XmlSerializer.deserialize(text).getNumParticles())
""",
    "open3d": "import open3d\nprint(open3d.geometry.TriangleMesh.create_sphere(1.0, 5))\n",
}


def run(program):
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-W", "ignore", "-c", program]
        try:
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120)
        except subprocess.TimeoutExpired:
            return "did not return within 120 s"
    error = done.stderr.strip().splitlines()[-1:] if done.returncode != 0 else []
    return "\n".join([done.stdout.strip(), *error, f"exit status {done.returncode}"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--require", type=int, default=1, metavar="N", help="packages that must be installed [1]")
    arguments = parser.parse_args()
    failed, checked = [], 0
    for name, program in PROGRAMS.items():
        if importlib.util.find_spec(name) is None:
            print(f"{name}: not installed")
            continue
        alone, after = run(program), run("import jfpx\n" + program)
        checked += 1
        print(f"{name}: {'same output' if alone == after else 'DIFFERS'}")
        if alone != after:
            failed.append(f"{name} alone: {alone}\n{name} after jfpx")
    print("\n".join(failed))
    if checked < arguments.require:
        failed.append("")
        print(f"only {checked} packages are installed; {arguments.require} are required")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
