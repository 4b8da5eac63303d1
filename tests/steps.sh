# shellcheck shell=bash
# Sourced by .ci/run and tests/full.sh, whose steps are functions:  run_steps STEP...
#
# All steps run, even where one fails. At the end all are listed with their seconds, and what was
# skipped and why. Returns 1 if one has failed, and sets `skipped_steps` to how many were skipped.
mkdir -p build
told_list=$PWD/build/told.txt
skipped_list=$PWD/build/skipped.txt
skipped_step=$PWD/build/skipped_step

export LSAN_OPTIONS=suppressions=$PWD/tests/leak_sanitizer_ignored.txt:print_suppressions=0

# What has to do with threads: the library's, the user's, and caches that the first query fills.
# shellcheck disable=SC2034
thread_suites=(threads_test arrays_test index_test meshes_test motion_test)

# tell WHAT: also at the end.
tell() {
  echo "$1" | tee -a "$told_list"
}

# skip WHAT_AND_WHY: tells of it at the end.
skip() {
  echo "$step: $1" >>"$skipped_list"
  echo "skipped: $1"
}

# skip_step WHY: ends the step, of which nothing has run. The file tells it from a program that ends
# with this status, as libFuzzer does where an input fails.
step_skipped=77
skip_step() {
  skip "$1"
  : >"$skipped_step"
  exit "$step_skipped"
}

# turn_of TURNS: which of so many turns this commit has, counted from 0. What takes turns runs with one
# commit of so many, so each commit has to know its number.
turn_of() {
  local is_shallow count
  if ! is_shallow=$(git rev-parse --is-shallow-repository) || [[ $is_shallow != false ]] ||
    ! count=$(git rev-list --count HEAD); then
    echo "The commits cannot be counted, so it is unknown whose turn it is. This needs a clone with the" \
      "whole history (git fetch --unshallow), whose owner is the one who runs it (or git config" \
      "--global --add safe.directory $PWD)." >&2
    return 1
  fi
  echo $((count % $1))
}

# has_pypi: whether pip can install packages that are not here yet.
has_pypi() {
  /usr/bin/python3 -m pip download -q --retries 0 --no-cache-dir --no-deps --dest build/pypi pybind11
}

run_steps() {
  local failed=0 status begin
  local lines=()
  skipped_steps=0
  : >"$skipped_list"
  : >"$told_list"
  for step in "$@"; do
    printf '\n== %s ==\n' "$step"
    begin=$SECONDS
    rm -f "$skipped_step"
    # A shell of its own, and no condition around it, as either would let a step go on after an error.
    set +e
    (
      set -e
      "$step"
    )
    status=$?
    set -e
    if ((status == 0)); then
      status=passed
    elif ((status == step_skipped)) && [[ -e $skipped_step ]]; then
      status=skipped && ((++skipped_steps))
    else
      status=FAILED && ((++failed))
    fi
    lines+=("$(printf '%6d s  %s  %s' $((SECONDS - begin)) "$status" "$step")")
    echo "-- ${lines[-1]}"
  done

  printf '\n== Summary ==\n'
  printf '%s\n' "${lines[@]}"
  sed 's/^/skipped: /' "$skipped_list"
  cat "$told_list"
  printf '%6d s in all. Steps: %d passed, %d failed, %d skipped\n' "$SECONDS" \
    $(($# - failed - skipped_steps)) "$failed" "$skipped_steps"
  ((failed == 0))
}
