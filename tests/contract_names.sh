#!/usr/bin/env bash
# Whether every test that docs/contract.md names is there.
set -euo pipefail
cd "$(dirname "$0")"

missing=0
while IFS=. read -r suite name; do
  pattern="^(TYPED_)?TEST(_F|_P)?\($suite, $([[ $name == '*' ]] && echo '\w+' || echo "$name")\)"
  if ! grep -rqE "$pattern" --include='*_test.cpp' .; then
    echo "docs/contract.md names $suite.$name, which is no test" >&2
    missing=1
  fi
done < <(grep -oE '\b[A-Z]\w+\.([A-Z]\w+|\*)' ../docs/contract.md | grep -E '\.(\*|[A-Z])' | sort -u)
exit $missing
