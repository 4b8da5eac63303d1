#!/usr/bin/env bash
# Whether every test that docs/contract.md, docs/crossings.md and docs/numerics.md name is there, and whether the rows
# of the latter are those that are tested:
#
#   tests/contract_names.sh NUMERICS_TEST     # the executable
set -euo pipefail
numerics_test=$(realpath "$1")
cd "$(dirname "$0")"

wrong=0
complain() {
  echo "docs/$1" >&2
  wrong=1
}

# is_test SUITE NAME: both are patterns.
is_test() {
  grep -rqE "^(TYPED_)?TEST(_F|_P)?\($1, $2\)" --include='*_test.cpp' .
}

for page in contract.md crossings.md numerics.md; do
  while IFS=. read -r suite name; do
    is_test "$suite" "$([[ $name == '*' ]] && echo '\w+' || echo "$name")" ||
      complain "$page names $suite.$name, which is no test"
  done < <(grep -oE '`[^`]+`' "../docs/$page" | grep -oE '\b[A-Z]\w+\.([A-Z]\w+|\*)' | sort -u)

  # By itself, a name in the last column of a table is a suite, or a test of the suite before it.
  while read -r name; do
    is_test "$name" '\w+' || is_test '\w+' "$name" ||
      complain "$page names $name, which is neither a suite nor a test"
  done < <(sed -nE 's/^\|.*\|([^|]*)\|$/\1/p' "../docs/$page" | grep -oE '`[A-Z]\w+`' |
    tr -d '`' | sort -u)
done

while read -r name; do
  grep -rqE "def $name\(" --include='*.py' . || complain "crossings.md names $name, which is no test"
done < <(grep -oE '`test_\w+`' ../docs/crossings.md | tr -d '`' | sort -u)

rows_named=$(sed -nE '/^## Rows/,/^## Other/s/^\| ([A-Z]\w+) \|.*/\1/p' ../docs/numerics.md | sort)
for scalar in Float Double; do
  rows_tested=$("$numerics_test" --gtest_list_tests --gtest_filter="Rows/ExtremeTest.$scalar/*" |
    sed -nE "s|^  $scalar/(\w+).*|\1|p" | sort)
  [[ -n $rows_tested ]] || complain "numerics.md names Rows/ExtremeTest.$scalar, which has no rows"
  difference=$(diff <(echo "$rows_named") <(echo "$rows_tested")) ||
    complain "numerics.md has other rows (<) than Rows/ExtremeTest.$scalar (>):"$'\n'"$difference"
done
exit $wrong
