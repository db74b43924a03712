#!/usr/bin/env bash
# `ropsim sweep` under mpirun: three ranks of this machine, of which rank 0 alone speaks; runs and ranks that are killed or
# hang. What a launcher's environment must not start stands first, since it needs no MPI.
source "$(dirname "$0")/check.bash"
cat >"$work/sweep.yaml" <<'END'
results: sweep.db
traces: record scene:sheets,count=64,order=shuffled size=96x96
programs: [layer_peel, coherent_layer_peel_a, ideal_coherent_layer_peel]
machines: programmable
set: {depth_format: [z16, z24], stencil_bits: 6..7}
END
sweep=$work/sweep.yaml

# A command without the module beside it is one that was built without MPI.
mkdir "$work/bare"
cp "$ropsim" "$work/bare"
built=$ropsim ropsim=$work/bare/ropsim
OMPI_COMM_WORLD_SIZE=3 OMPI_COMM_WORLD_RANK=0 expect 1 "started as 3 ranks, but MPI is not built in" sweep "$sweep"
SLURM_STEP_NUM_TASKS=3 SLURM_PROCID=0 expect 1 "srun --mpi=pmix" sweep "$sweep"
[[ -e $work/sweep.db ]] && complain "a refused sweep made a database"
# A shell within an allocation, and a single rank, are no reason to ask for MPI.
sed 's/^traces.*/traces: record scene:knot,rings=8 size=8x8/; s/sweep.db/small.db/' "$sweep" >"$work/small.yaml"
SLURM_JOB_ID=7 SLURM_NTASKS=3 SLURM_PROCID=0 PMIX_RANK=0 expect 0 "12 runs: 0 were there" sweep "$work/small.yaml"
OMPI_COMM_WORLD_SIZE=1 OMPI_COMM_WORLD_RANK=0 SLURM_STEP_NUM_TASKS=3 SLURM_PROCID=0 \
    expect 0 "12 runs: 12 were there" sweep "$work/small.yaml"
ropsim=$built
expect 2 "--silence is \`3\`, but must be an integer from 4" sweep "$sweep" --silence 3

if ! command -v mpirun >/dev/null || [[ ! -e $build_folder/ropsim_mpi.so ]]; then
    ((failures > 0)) && finish
    echo "skipped: mpirun is not installed, or MPI is not built in; the rest passed"
    exit 77
fi
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
PMI_SIZE=3 PMI_RANK=0 expect 1 "MPI takes it for rank 0 of 1" sweep "$sweep"  # another MPI's mpirun

# mpi STATUS TEXT [WORD...]: three ranks; the sweep as it is, and in $said what they and mpirun say.
mpi() {
    local wanted=$1 text=$2 status=0
    shift 2
    checks=$((checks + 1))
    said=$(mpirun --oversubscribe --mca btl self,vader -n 3 "$ropsim" sweep "$@" 2>&1) || status=$?
    [[ $status == "$wanted" ]] || complain "three ranks, sweep $*: exit status $status, wanted $wanted; they said: $said"
    [[ $said == *"$text"* ]] || complain "three ranks, sweep $*: \`$text\` is not in: $said"
}
once() { [[ $(grep -c "$1" <<<"$said") == 1 ]] || complain "\`$1\` was to be said once, in: $said"; }

mpi 2 "a sweep file is wanted"
once "a sweep file is wanted"
mpi 3 "cannot be opened" "$work/none.yaml"
once "cannot be opened"
mpi 0 "12 runs: 12 were there, 0 done, 0 refused by the machine, 0 failed" "$work/small.yaml" --table
once "12 runs"
mpi 0 "| programmable | depth_format=z16 stencil_bits=6 |" "$work/small.yaml" --no-run --table

children() { cat /proc/"$1"/task/"$1"/children 2>/dev/null; }
rank_of() { tr '\0' '\n' <"/proc/$1/environ" 2>/dev/null | sed -n 's/^OMPI_COMM_WORLD_RANK=//p'; }

# Starts the sweep on three ranks, with options, and once a run of rank 1 is seen, sets $job, $rank1 and $run1: mpirun, the rank, the
# run's process, which is stopped.
start_job() {
    local pid
    rm -rf "$work"/sweep.db*
    mpirun --oversubscribe --mca btl self,vader -n 3 "$ropsim" sweep "$sweep" "$@" >"$work/said" 2>&1 &
    job=$! rank1='' run1=''
    for ((i = 0; i < 500; i++)); do
        for pid in $([[ $rank1 ]] || children $job); do [[ $(rank_of "$pid") == 1 ]] && rank1=$pid; done
        run1=$([[ -z $rank1 ]] || children "$rank1")
        run1=${run1%% *}
        # One that has just ended cannot be stopped any more.
        [[ $run1 ]] && kill -STOP "$run1" 2>/dev/null && sleep 0.01 && grep -q '^State:.T' "/proc/$run1/status" && return
        sleep 0.01
    done 2>/dev/null
    complain "no run of rank 1 was seen; the ranks said: $(<"$work/said")"
}
end_job() {
    local status=0
    wait "$job" || status=$?
    said=$(<"$work/said")
    [[ $status =~ ^($1)$ ]] || complain "$2: exit status $status, wanted $1; they said: $said"
}

# The process of a run: it is reported, all others are done, and the next call does it.
start_job
kill -9 "$run1"
end_job 1 "a run was killed"
once "failed: the run's process was ended by signal 9"
[[ $said == *"12 runs: 0 were there"*" 1 failed"* ]] || complain "a run was killed: $said"
mpi 0 "12 runs: 11 were there, 1 done, 0 refused by the machine, 0 failed" "$sweep"

# A rank: mpirun ends all, and the next call goes on.
start_job
kill -9 "$rank1"
end_job 137 "a rank was killed"
mpi 0 " 0 failed" "$sweep"
expect 0 "12 runs: 12 were there" sweep "$sweep"

# A rank that hangs: it is given up, and the others do what it had. Open MPI 4.1.4's mpirun now and then crashes (139) when
# it cleans up behind it, and all is done.
start_job --silence 4
kill -STOP "$rank1"
kill -CONT "$run1"
end_job "0|139" "a rank hung"
once "rank 1 on .* has said nothing for 4 seconds and is given up"
[[ $said == *"12 runs: 0 were there"*" 0 failed"* ]] || complain "a rank hung: $said"
expect 0 "12 runs: 12 were there" sweep "$sweep"
finish
