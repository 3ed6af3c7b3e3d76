"""`python -m jfpx ARGUMENTS` runs the command `jfpx`, where it is installed."""

import os
import shutil
import sys


def main() -> int:
    folder = os.path.dirname(sys.executable)
    command = shutil.which("jfpx", path=os.pathsep.join([folder, os.environ.get("PATH", "")]))
    if command is None:
        print("jfpx: the command is not installed, and the Python package does not contain it. To "
              "have it, run scripts/run in a clone of jfpx, and add the folder build/run/bin to "
              "PATH. Python alone can run named scenes (jfpx.World) and repeat recordings "
              "(jfpx.Recording).", file=sys.stderr)
        return 3
    os.execv(command, ["jfpx", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
