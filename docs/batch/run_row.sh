#!/usr/bin/env bash
# One job of a sweep: run_row.sh DECK SWEEP.csv ROW RESULTS      (ROW from 1; the header is not counted)
#
# Knows nothing of the scheduler, so that it can be tried in any shell. Runs the deck with the row's parameters in a
# scratch folder, copies what there is into RESULTS whatever happens, and writes the exit status into RESULTS/JOB.exit,
# by which rfem_collect.py knows the jobs that left nothing else.
#
# A run that was interrupted (exit status 4: a signal, the wall-clock limit of its *RESTART) or killed goes on from the
# checkpoint RESULTS/JOB.rst.h5 when the row is run again; RFEM_AGAIN has it run again by itself, until it is done.
#
# RFEM         the program                                     (default: rfem on the PATH)
# RFEM_RECOVER what repairs the files of a run that was killed  (default: nothing is repaired)
# RFEM_AGAIN   command that puts the row into the queue again, called when it was interrupted   (default: nothing is done)
# RFEM_PIECES  in how many pieces a run may be done                                             (default: 50)
# TMPDIR       where the scratch folder is made: a disk of the node, not the shared one (default: /tmp)
set -euo pipefail

deck=$1 sweep=$2 row=$3 results=$4
rfem=${RFEM:-rfem}

# The row: the header has the names (job, then parameters), the row their values.
IFS=, read -r -a names < <(head -n 1 "$sweep" | tr -d '\r ') || true
IFS=, read -r -a values < <(tail -n +2 "$sweep" | grep -v '^ *$' | sed -n "${row}p" | tr -d '\r ') || true
[ "${names[0]:-}" = job ] || { echo "$sweep: the first column must be job" >&2; exit 2; }
[ ${#values[@]} -eq ${#names[@]} ] || { echo "$sweep has no row $row with ${#names[@]} values" >&2; exit 2; }
job=${values[0]}
settings=()
for ((i = 1; i < ${#names[@]}; i++)); do settings+=(--set "${names[i]}=${values[i]}"); done

# Ended by itself before (status 0 to 3) or not begun: from the deck. Else from the checkpoint, if there is one.
before=$(cat "$results/$job.exit" 2>/dev/null || echo none)
pieces=0
if [ -e "$results/$job.rst.h5" ] && [[ ! $before =~ ^[0-3]$ ]]; then
   pieces=$(cat "$results/$job.pieces" 2>/dev/null || echo 1)
fi

# Frames are written in many small pieces: a disk of the node bears that better than a file system that all nodes share.
mkdir -p "$results"
scratch=$(mktemp -d "${TMPDIR:-/tmp}/rfem_${job}_XXXXXX")
status=137 # unless the program says otherwise: it was killed
child=
# shellcheck disable=SC2329 # the trap calls it
bring_home() {
   if [ "$status" -ge 128 ] && [ -n "${RFEM_RECOVER:-}" ] && [ -e "$scratch/$job.h5" ]; then
      $RFEM_RECOVER "$scratch/$job" || true
   fi
   echo $((pieces + 1)) >"$scratch/$job.pieces"
   cp -p "$scratch"/. "$results"/ -r
   echo "$status" >"$results/$job.exit"
   rm -rf "$scratch"
}
trap bring_home EXIT
# The scheduler's notice that time is up goes on to the program, which writes a checkpoint and ends with status 4; then
# there is time to bring the results home. Likewise for a checkpoint on the way (SIGUSR1).
trap '[ -z "$child" ] || kill -TERM "$child" 2>/dev/null || true' TERM INT
trap '[ -z "$child" ] || kill -USR1 "$child" 2>/dev/null || true' USR1

arguments=("$deck" --job "$job" "${settings[@]}" --output "$scratch")
if [ "$pieces" -gt 0 ]; then
   for ending in .h5 .vtkhdf _cracks.vtkhdf _history.csv _events.csv .dat .mac .rst.h5 .rst.1.h5 .log .err; do
      if [ -e "$results/$job$ending" ]; then cp -p "$results/$job$ending" "$scratch"/; fi
   done
   arguments=(--restart "$scratch/$job.rst.h5")
else
   rm -f "$results/$job".rst.h5 "$results/$job".rst.1.h5 "$results/$job".exit "$results/$job".pieces
fi
"$rfem" "${arguments[@]}" --quiet >>"$scratch/$job.log" 2>>"$scratch/$job.err" &
child=$!
status=0
wait "$child" || status=$?
while kill -0 "$child" 2>/dev/null; do # the wait was ended by a signal, not by the program
   status=0
   wait "$child" || status=$?
done
if [ "$status" -eq 4 ] && [ -n "${RFEM_AGAIN:-}" ]; then
   trap - EXIT
   bring_home
   if [ $((pieces + 1)) -lt "${RFEM_PIECES:-50}" ]; then
      $RFEM_AGAIN || echo "$job: '$RFEM_AGAIN' failed; run the row again by hand" >&2
   else
      echo "$job: not done after $((pieces + 1)) pieces (RFEM_PIECES)" >&2
   fi
fi
exit "$status"
