#!/bin/sh
# Converts models on many hosts with GNU parallel over ssh: a job is a shard, and each host has one job at a time.
# usage: parallel_ssh.sh HOSTS SHARDS OUTDIR INPUTS... [options of trimray batch]
#   HOSTS   a file with a host a line, as user@host (parallel --sshloginfile)
#   SHARDS  several a host, four say: one that is done early takes more, one that is lost loses less
# The hosts see OUTDIR and INPUTS under the same absolute paths, and have trimray on their PATH (or at $TRIMRAY).
set -eu
[ $# -ge 4 ] || { sed -n '2,6s/^# //p' "$0" >&2; exit 1; }
hosts=$1 shards=$2 out=$3
shift 3
mkdir -p "$out" || exit 2

# a host that is gone without a word is given up after 30 s
alive='-o ConnectTimeout=10 -o ServerAliveInterval=10 -o ServerAliveCountMax=3'
export PARALLEL_SSH="${PARALLEL_SSH:-ssh} -o BatchMode=yes $alive"
exec parallel --sshloginfile "$hosts" --jobs 1 --retries 4 --halt never --joblog "$out/parallel.joblog" \
    --tag --line-buffer --quote -I '{shard}' \
    "${TRIMRAY:-trimray}" batch "$@" -o "$out" --shard "{shard}/$shards" --resume --failures-ok \
    ::: $(seq 0 $((shards - 1)))
