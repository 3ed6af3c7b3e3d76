"""Shows a run in 3D: as an HTML file that any browser plays, and, in a notebook, live. The cells below
can be pasted into a notebook; `pip install anywidget` makes the picture follow the world there.

    python view.py [--scene capsules] [--steps 240] [--save capsules.html]
"""

# %% The world
import argparse

import jfpx

parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
parser.add_argument("--scene", choices=sorted(jfpx.scene_names()), default="capsules")
parser.add_argument("--steps", type=int, default=240)
parser.add_argument("--save", metavar="FILE.html", help="file for the run")
options = parser.parse_args()
world = jfpx.World(options.scene, threads=0)

# %% Every second state of a run, with a slider
states = [world.states()]
for _ in range(options.steps // 2):
    world.run(2)
    states.append(world.states())
film = world.scene.view(states, interval=2 * world.scene.dt)
film  # as the last expression of a cell, a notebook shows it
print(film)

# %% In a file
if options.save:
    film.save(options.save)
    print(f"{options.save} can be opened by a browser, without a network")

# %% In a notebook, live
if "get_ipython" in globals():
    from IPython.display import display

    view = world.view()
    display(view)
    with view.follow():
        world.run(300)
