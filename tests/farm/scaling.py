"""How a bake scales on a farm, simulated with measured times.

python scaling.py TIMINGS.json [--items 10000] [--megabytes 1.6] [--start 0.05] [--tasks-per-second 20]
                  [--server-megabytes 1000] [--server-files 2000] [--per-file 3]

TIMINGS.json is what `strandlight bake --threads 1 --timings` wrote; items take times drawn from it. Tasks
start one after another, at the rate of the scheduler; each then takes the start of the program and its
share of the items, round robin. Reads queue at a file server with so much bandwidth and so many opened
files a second. Prints, for each number of cores, the hours, the efficiency, and what waits most.
"""

import argparse
import heapq
import json
import random


def simulate(seconds, cores, args):
    """Makespan, seconds that tasks waited for the scheduler, and for the file server."""
    service = args.megabytes / args.server_megabytes + args.per_file / args.server_files
    shares = [seconds[shard::cores] for shard in range(cores)]
    # (time at which a task asks for its next file, shard)
    asks = [((shard + 1) / args.tasks_per_second + args.start, shard) for shard in range(cores) if shares[shard]]
    waited_to_start = sum(time - args.start for time, _ in asks)
    heapq.heapify(asks)
    server_free, waited_for_files, end = 0.0, 0.0, 0.0
    next_item = [0] * cores
    while asks:
        time, shard = heapq.heappop(asks)
        begin = max(time, server_free)
        server_free = begin + service
        waited_for_files += server_free - time
        done = server_free + shares[shard][next_item[shard]]
        next_item[shard] += 1
        end = max(end, done)
        if next_item[shard] < len(shares[shard]):
            heapq.heappush(asks, (done, shard))
    return end, waited_to_start, waited_for_files


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("timings")
    parser.add_argument("--items", type=int, default=10000)
    parser.add_argument("--megabytes", type=float, default=1.6, help="size of a map")
    parser.add_argument("--start", type=float, default=0.05, help="seconds until the program reads its first map")
    parser.add_argument("--tasks-per-second", type=float, default=20, help="what the scheduler starts")
    parser.add_argument("--server-megabytes", type=float, default=1000, help="a second, of the file server")
    parser.add_argument("--server-files", type=float, default=2000, help="opened or renamed a second")
    parser.add_argument("--per-file", type=float, default=3, help="files opened or renamed for an item")
    args = parser.parse_args()
    with open(args.timings) as file:
        measured = [item["seconds"] for item in json.load(file)["items"]]
    rng = random.Random(1)
    seconds = [rng.choice(measured) for _ in range(args.items)]
    work = sum(seconds)
    print(f"{args.items} items, {work / 3600:.2f} core-hours, {work / args.items:.2f} s each")
    print("| cores | minutes | efficiency | waited for the scheduler | for files |\n|---|---|---|---|---|")
    for cores in (1, 10, 100, 300, 1000, 3000):
        end, scheduler, files = simulate(seconds, cores, args)
        shares = [100 * waited / (end * cores) for waited in (scheduler, files)]
        print(f"| {cores} | {end / 60:.1f} | {100 * work / (end * cores):.0f} % | {shares[0]:.1f} % | {shares[1]:.1f} % |")


main()
