#!/bin/sh
#SBATCH --job-name=trimray
#SBATCH --nodes=1 --ntasks=1 --cpus-per-task=8 --mem-per-cpu=4G
#SBATCH --requeue --open-mode=append
#SBATCH --output=trimray-%A_%a.log
# Converts models with a Slurm job array: a task is a shard. A task whose node is lost is queued again by Slurm.
# usage: sbatch --array=0-15 slurm_array.sh OUTDIR INPUTS... [options of trimray batch]
# The nodes see OUTDIR and INPUTS under the same absolute paths, and have trimray on their PATH (or at $TRIMRAY).
set -u
shards=${SHARDS:-$SLURM_ARRAY_TASK_COUNT}
if [ $((SLURM_ARRAY_TASK_MAX + 1)) -gt "$shards" ]; then
    echo "slurm_array: --array is not all of 0-N; to run a few tasks again set SHARDS to the number of all" >&2
    exit 1
fi
out=$1
shift

"${TRIMRAY:-trimray}" batch "$@" -o "$out" --shard "$SLURM_ARRAY_TASK_ID/$shards" --resume --failures-ok \
    --jobs "$SLURM_CPUS_PER_TASK" --memory-limit "${SLURM_MEM_PER_CPU}MiB" # a processor, and its memory, a file
status=$?
if [ $status -gt 128 ] && [ "${SLURM_RESTART_COUNT:-0}" -lt 3 ]; then # stopped by a signal, the node lives
    scontrol requeue "$SLURM_JOB_ID" && sleep 60 # until Slurm ends this run
fi
exit $status
