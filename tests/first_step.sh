#!/bin/bash
# What the first step of a newcomer takes: bare Debian, git, this clone's commit, one command.
#     tests/first_step.sh bookworm|trixie COMMAND [WORD]…      e.g. bookworm run
# As root, with mmdebstrap and a network. The tree stays in $TMPDIR/first-step-SUITE. Prints rows of
# docs/reference/first_step.csv: time of the clock and of the processors, megabytes by step.
set -euo pipefail
suite=$1
shift
here=$(cd -- "$(dirname -- "$0")/.." && pwd)
root=${TMPDIR:-/tmp}/first-step-$suite
commit=$(git -C "$here" rev-parse --short HEAD)
[[ ! -e $root ]] || { echo "$root: is there already (of an earlier call) remove it" >&2; exit 2; }

mmdebstrap --quiet --variant=minbase "$suite" "$root"
cp -L /etc/resolv.conf "$root/etc/resolv.conf"
git clone -q --bare "$here" "$root/srv/grainpair.git"

# Runs words in the tree, with mounts that end with them.
inside() {
  # shellcheck disable=SC2016  # of the inner shell
  unshare -m --propagation private bash -c 'root=$1; shift
    mount -t proc proc "$root/proc"; mount --rbind /dev "$root/dev"
    mount --rbind /sys "$root/sys"; mount -t tmpfs tmp "$root/tmp"
    exec env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 chroot "$root" "$@"' \
    inside "$root" "$@"
}
# Megabytes of the system: without the clone, and without what apt keeps of its own.
size() {
  du -sx -B1000000 --exclude="$root/root" --exclude="$root/srv" --exclude="$root/var/cache/apt" \
    --exclude="$root/var/lib/apt" "$root" | cut -f1
}
row() { echo "$suite,$1,$2,$3,$commit,"; }

bare=$(size)
inside bash -c 'apt-get update -qq && apt-get install -qq -y --no-install-recommends git' >/dev/null 2>&1
row "added by git" $(($(size) - bare)) MB
start=$SECONDS
TIMEFORMAT='%U %S'
cpu=$({ time inside bash -c 'cd /root && git config --global --add safe.directory "*" &&
  git clone -q /srv/grainpair.git && cd grainpair && git checkout -q '"$commit"' && exec ./grainpair "$@"' \
  first "$@" >&2; } 2> >(tee /dev/stderr | tail -n 1))
row "clone and grainpair $*: clock" $((SECONDS - start)) s
row "clone and grainpair $*: processors" "$(awk '{printf "%.0f", $1 + $2}' <<<"$cpu")" s
row "added by all" $(($(size) - bare)) MB
row "kept by apt" "$(du -sxc -B1000000 "$root/var/cache/apt" "$root/var/lib/apt" | tail -n 1 | cut -f1)" MB
row "build" "$(du -sx -B1000000 "$root/root/grainpair/build" | cut -f1)" MB
