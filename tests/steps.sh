# shellcheck shell=bash
# Sourced by .ci/run and tests/full.sh, whose steps are functions:  run_steps STEP...
#
# All steps run, even where one fails. At the end all are listed with their seconds, and what was
# skipped and why. Returns 1 if one has failed.
mkdir -p build
skipped_list=$PWD/build/skipped.txt

# skip WHAT_AND_WHY: tells of it at the end.
skip() {
  echo "$step: $1" >>"$skipped_list"
  echo "skipped: $1"
}

run_steps() {
  local failed=0 status begin
  local lines=()
  : >"$skipped_list"
  for step in "$@"; do
    printf '\n== %s ==\n' "$step"
    begin=$SECONDS
    # A shell of its own, and no condition around it, as either would let a step go on after an error.
    set +e
    (
      set -e
      "$step"
    )
    status=$?
    set -e
    ((status == 0)) && status=passed || status=FAILED
    [[ $status == passed ]] || ((++failed))
    lines+=("$(printf '%6d s  %s  %s' $((SECONDS - begin)) "$status" "$step")")
    echo "-- ${lines[-1]}"
  done

  printf '\n== Summary ==\n'
  printf '%s\n' "${lines[@]}"
  sed 's/^/skipped: /' "$skipped_list"
  printf '%6d s in all. Steps: %d passed, %d failed\n' "$SECONDS" $(($# - failed)) "$failed"
  ((failed == 0))
}
