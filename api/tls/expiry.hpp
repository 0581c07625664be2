// When the files of `server.tls` are of no more use, and when to say so.
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/tls/pem_files.hpp"
#include "buses/clock.hpp"

namespace axisd::tls {

/// When the first of the certificates that a PEM text holds expires; the last time that there is: none does.
[[nodiscard]] WallTime first_expiry(const std::string& certificates);

/// A file that is of use for some time only.
struct Expiry {
  std::string path;
  std::string_view what;      ///< "the certificate", "an authority of the clients", "the CRL": a literal
  WallTime at;                ///< the first thing in it that ends; the last time that there is: nothing does
  std::string_view key = {};  ///< below server.tls: a literal
};

/// Of all files; authorities that have expired beside others that have not are left out. `contents`: as
/// read() gives them.
[[nodiscard]] std::vector<Expiry> expiries(const Files& paths, const Files& contents, WallTime now);

/// Says 30 days ahead that a file ends, once more when it has ended, and both again every day. Pure.
class Reminder {
 public:
  static constexpr Duration ahead = std::chrono::days(30);
  static constexpr Duration again = std::chrono::days(1);

  struct Notice {
    bool over;
    std::string path;
    WallTime at;
    std::string text;  ///< one line, with what to do
  };
  /// What there is to say now: by the wall clock, and by one that does not jump. In any order of times.
  [[nodiscard]] std::vector<Notice> due(const std::vector<Expiry>& all, WallTime wall, TimePoint now);

 private:
  struct Said {
    WallTime at;
    bool over;
    TimePoint when;
  };
  /// By path and what: a file may be named by two keys.
  std::map<std::pair<std::string, std::string_view>, Said> said_;
};

}  // namespace axisd::tls
