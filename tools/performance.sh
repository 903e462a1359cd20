#!/bin/bash
# Measures everything that docs/performance.md tells: throughput, how cost grows, the peers. Rewrites the page's figures and plots.
set -euo pipefail
source "$(dirname "$0")/common.sh"

usage() {
  cat <<END
usage: tools/performance.sh [option...] DATA
  DATA        folder of captured clouds; without it, SWARMFIT_DATA_DIR
  --short     a few runs of each, to see that it works: the figures are worth little
  --no-setup  install nothing; peers that are not there are said and left out
  --bin DIR   a build that has swarmfit and swarmfit_peers; else one is made in build/release
  --out DIR   where the measurements go [out/performance]
  --docs DIR  folder of the performance.md to rewrite [docs]
  --only LIST of throughput, growth, peers, plots, parted by commas [all]
Run it on a machine that does nothing else.
END
}

data=${SWARMFIT_DATA_DIR-} out=out/performance docs=docs bin='' setup=yes only=throughput,growth,peers,plots
runs=20 seconds=0.3 budget=60
points=1000,10000,100000,1000000,10000000 particles=16,64,256,1024,4096
while [ $# -gt 0 ]; do
  case "$1" in
    --short) runs=3 seconds=0.03 budget=5 points=1000,10000,100000,1000000 particles=16,64,256,1024 ;;
    --no-setup) setup=no ;;
    --bin) bin=$2; shift ;;
    --out) out=$2; shift ;;
    --docs) docs=$2; shift ;;
    --only) only=$2; shift ;;
    -h|--help) usage; exit 0 ;;
    -*) usage >&2; exit 2 ;;
    *) data=$1 ;;
  esac
  shift
done
wanted() { [[ ",$only," == *",$1,"* ]]; }

# Below $data; what is not there is said and left out.
clouds=(mosd/learn0.pcd mosd/learn20.pcd mosd/learn44.pcd clouds/table_scene_mug_stereo_textured.pcd clouds/room_scan1.pcd)
depth=rgbd/4.depth.png intrinsics=612.937,613.173,322.549,248.158

if [ $setup = yes ]; then tools/setup.sh --bench; fi
if [ -z "$bin" ]; then
  mkdir -p build
  say "building"
  configure release -DSWARMFIT_BUILD_BENCH=ON
  grep 'Bench:' build/release-configure.log || true
  cmake --build --preset release --target swarmfit_cli swarmfit_peers
  swarmfit=build/release/host/cli/swarmfit peers=build/release/bench/swarmfit_peers
else
  # Not what a test has installed below it.
  swarmfit=$(find "$bin" -name swarmfit -perm -u+x ! -type d ! -path '*/install-test/*' -print -quit)
  peers=$(find "$bin" -name swarmfit_peers -perm -u+x ! -type d -print -quit)
fi
mkdir -p "$out"

describe_machine() {
  SWARMFIT=$swarmfit python3 - <<'END' >"$out/machine.json"
import json, os, platform, re, subprocess

def tell(*command):
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""

cpu = re.search(r"model name\s*:\s*(.*)", open("/proc/cpuinfo").read())
family = re.search(r"cpu family\s*:\s*(.*)\nmodel\s*:\s*(.*)", open("/proc/cpuinfo").read())
name = (cpu.group(1) if cpu else platform.machine()) + (f" (family {family.group(1)}, model {family.group(2)})" if family else "")
system = re.search(r'PRETTY_NAME="(.*)"', open("/etc/os-release").read()).group(1) + ", Linux " + platform.release().split("-")[0]
devices = [line.strip() for line in tell(os.environ["SWARMFIT"], "devices").splitlines() if line.startswith("vulkan")]
json.dump({"processor": name, "cores": os.cpu_count(), "system": system,
           "compiler": (tell(os.environ.get("CXX", "c++"), "--version").splitlines() or ["?"])[0],
           "vulkan": re.sub(r"\s+", " ", "; ".join(devices)) or "none",
           # The page that this rewrites is no change to what was measured.
           "commit": tell("git", "describe", "--always", "--exclude=*") + ("-dirty" if tell("git", "status", "--porcelain", "--", ".", ":!docs") else ""), "load": f"{os.getloadavg()[0]:.1f}"},
          open(1, "w"), indent=1)
END
}

throughput() {
  say "throughput of each back end and kind"
  "$swarmfit" bench --points 307200 --particles 256 --pruning both --seconds "$seconds" --json "$out/kinds.json"
}

growth() {
  for threads in one all; do
    local count=0
    if [ $threads = one ]; then count=1; fi
    say "how cost grows, threads: $threads"
    "$swarmfit" bench --backend cpu --model plane --pruning both --threads $count --seconds "$seconds" \
      --points "$points" --particles 256 --json "$out/points-$threads.json"
    "$swarmfit" bench --backend cpu --model plane --pruning both --threads $count --seconds "$seconds" \
      --points 100000 --particles "$particles" --json "$out/particles-$threads.json"
  done
}

against_peers() {
  say "peers"
  [ -n "$data" ] || { echo "performance: no DATA given, no peers" >&2; return 0; }
  local there=()
  for cloud in "${clouds[@]}"; do
    if [ -f "$data/$cloud" ]; then there+=("$data/$cloud"); else echo "performance: no $data/$cloud, left out" >&2; fi
  done
  if [ -f "$data/$depth" ]; then there+=(--depth "$data/$depth" --intrinsics "$intrinsics"); else echo "performance: no $data/$depth" >&2; fi
  [ ${#there[@]} -gt 0 ] || return 0
  "$peers" "${there[@]}" --runs "$runs" --budget "$budget" --json "$out/peers.json" | tee "$out/peers.txt"
}

if [ "$only" != plots ]; then describe_machine; fi
if wanted throughput; then throughput; fi
if wanted growth; then growth; fi
if wanted peers; then against_peers; fi
if wanted plots; then
  say "plots"
  # Debian's matplotlib belongs to Debian's Python, which need not be the first on the path.
  python=python3
  python3 -c "import matplotlib" 2>/dev/null || python=/usr/bin/python3
  "$python" tools/plot_performance.py "$out" --docs "$docs"
fi
