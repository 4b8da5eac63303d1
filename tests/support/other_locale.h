// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <locale>
#include <string>

namespace fcl_fibers::test {

/// While it lives, the program's locale writes 1.234,5 for 1234.5, as a host's may.
class OtherLocale {
 public:
  OtherLocale() : before_(std::locale::global(std::locale(std::locale(), new Numbers))) {}
  OtherLocale(const OtherLocale&) = delete;
  OtherLocale& operator=(const OtherLocale&) = delete;
  ~OtherLocale() { std::locale::global(before_); }

 private:
  struct Numbers : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };

  std::locale before_;
};

}  // namespace fcl_fibers::test
