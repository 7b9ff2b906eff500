#!/usr/bin/env bash
# One job of a sweep: run_row.sh DECK SWEEP.csv ROW RESULTS      (ROW from 1; the header is not counted)
#
# Knows nothing of the scheduler, so that it can be tried in any shell. Runs the deck with the row's parameters in a
# scratch folder, copies what there is into RESULTS whatever happens, and writes the exit status into RESULTS/JOB.exit,
# by which rfem_collect.py knows the jobs that left nothing else.
#
# RFEM         the program                                     (default: rfem on the PATH)
# RFEM_RECOVER what repairs the files of a run that was killed  (default: nothing is repaired)
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
   cp -p "$scratch"/. "$results"/ -r
   echo "$status" >"$results/$job.exit"
   rm -rf "$scratch"
}
trap bring_home EXIT
# The scheduler's notice that time is up goes on to the program; then there is time to bring the results home.
trap '[ -z "$child" ] || kill -TERM "$child" 2>/dev/null || true' TERM INT

"$rfem" "$deck" --job "$job" "${settings[@]}" --output "$scratch" --quiet >"$scratch/$job.log" 2>"$scratch/$job.err" &
child=$!
status=0
wait "$child" || status=$?
while kill -0 "$child" 2>/dev/null; do # the wait was ended by a signal, not by the program
   status=0
   wait "$child" || status=$?
done
exit "$status"
