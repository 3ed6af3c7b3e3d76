"""Runs many scenes over dask.distributed, and prints a table of hashes that does not depend on the
workers.

    python sweep.py [--scenes 200] [--steps 60] [--scheduler ADDRESS] [--serial]

Without an address, a LocalCluster of this machine runs the scenes. A worker uses the first GPU that it
sees where that is faster; dask-cuda, which sets CUDA_VISIBLE_DEVICES, gives each worker its own. A worker
that dies loses only time: dask runs its scenes again on another.
"""

import argparse

import jfpx


def simulate(seed, steps):
    """The hash of one pile. Runs in a worker, which needs only the seed."""
    scene = jfpx.Scene.named("pile", spheres=50 + seed % 100, seed=seed)
    with jfpx.World(scene, backend="auto") as world:
        world.run(steps)
        return f"{world.state_hash():016x}"


def run_serially(scenes, steps):
    return [simulate(seed, steps) for seed in range(1, scenes + 1)]


def run_distributed(scenes, steps, scheduler=None, workers=None):
    from dask.distributed import Client, LocalCluster

    if scheduler is None:
        cluster = LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
        with cluster, Client(cluster) as client:
            return gather(client, scenes, steps)
    with Client(scheduler) as client:
        return gather(client, scenes, steps)


def gather(client, scenes, steps):
    # pure=False: equal arguments of two runs are two tasks.
    futures = client.map(simulate, range(1, scenes + 1), steps=steps, retries=3, pure=False)
    return client.gather(futures)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--steps", type=int, default=60)
    parser.add_argument("--scheduler", help="address of a dask scheduler")
    parser.add_argument("--workers", type=int, help="of the LocalCluster; one per core if absent")
    parser.add_argument("--serial", action="store_true", help="without dask")
    options = parser.parse_args()
    if options.serial:
        hashes = run_serially(options.scenes, options.steps)
    else:
        hashes = run_distributed(options.scenes, options.steps, options.scheduler, options.workers)
    for seed, value in enumerate(hashes, 1):
        print(f"{seed:4} {value}")


if __name__ == "__main__":
    main()
