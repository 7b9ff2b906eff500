#!/usr/bin/env bash
# One job of a sweep: run_row.sh DECK SWEEP.csv ROW RESULTS      (ROW from 1; the header is not counted)
#
# Knows nothing of the scheduler, so that it can be tried in any shell. Runs the deck with the row's parameters in a
# scratch folder, copies what there is into RESULTS whatever happens, and writes the exit status into RESULTS/JOB.exit,
# by which rfem_collect.py knows the jobs that left nothing else. A wrong call or table: exit status 2, and nothing is run.
#
# A run that was interrupted (exit status 4: a signal, the wall-clock limit of its *RESTART), killed, or that had no room
# for its results (3) goes on from the checkpoint RESULTS/JOB.rst.h5 when the row is run again, or from the one before,
# JOB.rst.1.h5, where that is refused; RFEM_AGAIN has an interrupted one run again by itself, until it is done.
#
# RFEM         the program                                     (default: rfem on the PATH)
# RFEM_RECOVER what repairs the files of a run that was killed  (default: nothing is repaired)
# RFEM_AGAIN   command that puts the row into the queue again, called when it was interrupted   (default: nothing is done)
# RFEM_PIECES  in how many pieces a run may be done                                             (default: 50)
# TMPDIR       where the scratch folder is made: a disk of the node, not the shared one (default: /tmp)
set -euo pipefail

told=                  # the scheduler has said that time is up
trap 'told=1' TERM INT # from the first moment on; what is done about it comes below
trap : USR1

refuse() { echo "run_row.sh: error: $*" >&2; exit 2; }
[ $# -eq 4 ] || refuse "four arguments are needed, not $#: run_row.sh DECK SWEEP.csv ROW RESULTS (ROW from 1; the header is not counted)"
deck=$1 sweep=$2 row=$3 results=$4
rfem=${RFEM:-rfem}
[[ $row =~ ^[1-9][0-9]{0,8}$ ]] || refuse "'$row' is no row: rows count from 1, the header is not counted"
[ -n "$results" ] || refuse "the fourth argument, the folder of the results, is empty"
[ -f "$sweep" ] && [ -r "$sweep" ] || refuse "$sweep: there is no such table, or it may not be read"

# The whole table is looked at before anything is run: the header has the names (job, then parameters), each row their values.
# The same rules as those of rfem_collect.py. Prints the names, then the row's values, a word a line.
read_table() {
   LC_ALL=C awk -v path="$sweep" -v wanted="$row" '
      function fail(text) { print "run_row.sh: error: " path ":" NR ": " text >"/dev/stderr"; failed = 1; exit 2 }
      NR == 1 { sub(/^\357\273\277/, "") }
      { sub(/\r$/, "") }
      /^[ \t]*$/ { next }
      {
         count = split($0, cell, ",")
         for (i = 1; i <= count; i++) gsub(/^[ \t]+|[ \t]+$/, "", cell[i])
      }
      !columns {
         if (cell[1] != "job") fail("the first column of a sweep is job, the others are parameters")
         for (i = 1; i <= count; i++) {
            if (cell[i] !~ /^[A-Za-z0-9_]+$/) fail("\047" cell[i] "\047 is no name of a parameter (letters, digits and _)")
            if (cell[i] in known) fail("the column " cell[i] " is there twice")
            known[cell[i]]
            name[i] = cell[i]
         }
         columns = count
         next
      }
      {
         if (count != columns) fail(count " values for " columns " columns")
         if (cell[1] !~ /^[A-Za-z0-9_][A-Za-z0-9_.+-]*$/)
            fail("\047" cell[1] "\047 is no job name: letters, digits, _ . + -, the first no . + or -")
         if (cell[1] in seen) fail("the job " cell[1] " is there twice (line " seen[cell[1]] ")")
         seen[cell[1]] = NR
         for (i = 2; i <= count; i++)
            if (cell[i] !~ /^[^ \t"\047]+$/) fail("\047" cell[i] "\047 is no value for " name[i] ": one word without quotes")
         if (++rows == wanted) for (i = 1; i <= count; i++) value[i] = cell[i]
      }
      END {
         if (failed) exit 2
         if (!columns) { print "run_row.sh: error: " path " is empty" >"/dev/stderr"; exit 2 }
         if (rows < wanted) { print "run_row.sh: error: " path " has no row " wanted ", but " rows + 0 >"/dev/stderr"; exit 2 }
         for (i = 1; i <= columns; i++) print (i == 1) ? value[1] : name[i] "=" value[i]
      }' "$sweep"
}
# a signal to the whole group of processes ends awk too: once more
table=$(read_table) || { [ -n "$told" ] && table=$(read_table); } || exit 2
mapfile -t words <<<"$table"
job=${words[0]}
settings=()
for word in "${words[@]:1}"; do settings+=(--set "$word"); done

# Ended by itself before (status 0 to 2) or not begun: from the deck. Else from a checkpoint, if there is one.
before=$(cat "$results/$job.exit" 2>/dev/null || echo none)
pieces=0
checkpoints=()
if [[ ! $before =~ ^[0-2]$ ]]; then
   for ending in .rst.h5 .rst.1.h5; do
      if [ -e "$results/$job$ending" ]; then checkpoints+=("$ending"); fi
   done
fi
if [ ${#checkpoints[@]} -gt 0 ]; then pieces=$(cat "$results/$job.pieces" 2>/dev/null || echo 1); fi

# Frames are written in many small pieces: a disk of the node bears that better than a file system that all nodes share.
mkdir -p "$results"
scratch=$(mktemp -d "${TMPDIR:-/tmp}/rfem_${job}_XXXXXX")
status=137 # unless the program says otherwise: it was killed

# Messages name files of the scratch folder ("go on with: rfem --restart .."), which is removed: let them name those at home.
# shellcheck disable=SC2329 # bring_home calls it
name_home() {
   local from to file
   from=$(printf '%s/' "$scratch" | sed 's/[][\.*^$|]/\\&/g')
   to=$(printf '%s/' "$(cd "$results" && pwd)" | sed 's/[\&|]/\\&/g')
   for file in "$@"; do
      if [ -s "$file" ]; then sed -i "s|$from|$to|g" "$file" || true; fi
   done
}

# All is copied beside what is there and brought to the disk; then file after file takes its place, the checkpoint last.
# Whenever this is killed, the checkpoint in RESULTS is a whole one, and the results beside it are at least as long.
# shellcheck disable=SC2329 # the trap calls it
bring_home() {
   local new="$results/.$job.new"
   if [ "$status" -ge 128 ] && [ -n "${RFEM_RECOVER:-}" ] && [ -e "$scratch/$job.h5" ]; then
      $RFEM_RECOVER "$scratch/$job" || true
   fi
   echo $((pieces + 1)) >"$scratch/$job.pieces"
   rm -rf "$new"
   if ! cp -pr "$scratch" "$new"; then
      echo "$job: the results cannot be copied to $results; they are in $scratch on $(hostname)" >&2
      rm -rf "$new"
      return 1
   fi
   name_home "$new/$job.log" "$new/$job.err"
   sync "$new"/* 2>/dev/null || sync
   find "$new" -mindepth 1 -maxdepth 1 ! -name "$job.rst.*" -exec mv -f {} "$results" \;
   for ending in .rst.1.h5 .rst.h5; do
      if [ -e "$new/$job$ending" ]; then mv -f "$new/$job$ending" "$results"; fi
   done
   echo "$status" >"$results/$job.exit"
   rm -rf "$new" "$scratch" "$scratch.pid" "$scratch.status"
}
trap bring_home EXIT
# The scheduler's notice that time is up goes on to the program, which writes a checkpoint and ends with status 4; then
# there is time to bring the results home. Likewise for a checkpoint on the way (SIGUSR1).
trap 'told=1; forward TERM' TERM INT
trap 'forward USR1' USR1

# shellcheck disable=SC2329 # the traps call it
forward() {
   if [ -s "$scratch.pid" ]; then kill "-$1" "$(cat "$scratch.pid")" 2>/dev/null || true; fi
}

# Run the program with these arguments; its exit status becomes `status`. Not what `wait` tells: a signal ends a wait, and bash
# loses the status of what ends at that moment. A shell between, which no signal disturbs, writes it down.
run() {
   local child
   status=4
   if [ -n "$told" ]; then return; fi # interrupted before it began
   (
      trap : TERM INT USR1
      code=0
      # shellcheck disable=SC2016 # for the inner shell
      sh -c 'echo $$ >"$1.pid"; shift; exec "$@"' sh "$scratch" "$rfem" "$@" --quiet >>"$scratch/$job.log" 2>>"$scratch/$job.err" ||
         code=$?
      echo "$code" >"$scratch.status"
   ) &
   child=$!
   until [ -s "$scratch.pid" ] || ! kill -0 "$child" 2>/dev/null; do sleep 0.01; done
   if [ -n "$told" ]; then forward TERM; fi
   while [ ! -s "$scratch.status" ] && kill -0 "$child" 2>/dev/null; do wait "$child" || true; done
   status=$(cat "$scratch.status" 2>/dev/null || echo 137)
   rm -f "$scratch.pid" "$scratch.status"
   if [ "$status" -eq 126 ] || [ "$status" -eq 127 ]; then # the shell's
      echo "run_row.sh: error: $job: the program $rfem cannot be started; RFEM names another" | tee -a "$scratch/$job.err" >&2
   fi
   if [ -n "$told" ] && [ "$status" -eq 143 ]; then status=4; fi # while it was reading: nothing was changed
}

count_beginnings() {
   grep -c '^going on at ' "$scratch/$job.log" || true
}

if [ ${#checkpoints[@]} -gt 0 ]; then
   for ending in .h5 .vtkhdf _cracks.vtkhdf _history.csv _events.csv .dat .mac .rst.h5 .rst.1.h5 .log .err; do
      if [ -e "$results/$job$ending" ]; then cp -p "$results/$job$ending" "$scratch"/; fi
   done
   touch "$scratch/$job.log"
   beginnings=$(count_beginnings)
   for ending in "${checkpoints[@]}"; do
      run --restart "$scratch/$job$ending"
      # status 3 without having gone on: this checkpoint was refused, and nothing was changed
      if [ "$status" -ne 3 ] || [ "$(count_beginnings)" -gt "$beginnings" ]; then break; fi
      echo "$job: $job$ending is refused: $(tail -n 1 "$scratch/$job.err")" >&2
   done
else
   rm -f "$results/$job".rst.h5 "$results/$job".rst.1.h5 "$results/$job".exit "$results/$job".pieces
   run "$deck" --job "$job" "${settings[@]}" --output "$scratch"
fi
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
