// The users file, kept up to date, and passwords that are compared with it.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/thread_pool.hpp>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include "api/web/gateway/users.hpp"
#include "buses/error.hpp"

namespace axisd::web {

/// Who may log in, as the file says it now. Thread: one at a time.
class People {
 public:
  /// `named`: the configuration names the file, so it has to be there: who took it away did not mean that
  /// everybody at this computer is let in. Blocks for the disk. Errors: those of load_users(), and
  /// invalid_argument: it is not there.
  [[nodiscard]] static Result<People> load(std::string path, bool named);

  /// Reads the file anew where it has changed; a file that is wrong or gone changes nothing. True: it has
  /// changed.
  bool refresh();
  [[nodiscard]] const Users& users() const { return users_; }
  /// There is nobody, and never was: whoever is at this computer is let in.
  [[nodiscard]] bool nobody() const { return never_anybody_; }

 private:
  explicit People(std::string path) : path_(std::move(path)) {}
  /// What tells one content of the file from another.
  struct Stamp {
    std::int64_t changed_ns = 0, inode = 0, size = -1;
    friend bool operator==(const Stamp&, const Stamp&) = default;
  };
  [[nodiscard]] Stamp stamp() const;

  std::string path_;
  Stamp read_at_{};
  Users users_;
  bool never_anybody_ = true;
};

/// Compares passwords one at a time on a thread of its own. Thread: the executor's.
class PasswordWorker {
 public:
  /// Who waits for it beyond that is told so.
  static constexpr int most_waiting = 8;

  /// Takes a moment: it makes a hash of a password that nobody has.
  explicit PasswordWorker(boost::asio::any_io_executor executor);

  /// False: too many wait. `done` is called later, on the executor. An empty hash is that of nobody; it takes
  /// as long.
  [[nodiscard]] bool compare(std::string hash, std::string password, std::function<void(bool fits)> done);

 private:
  boost::asio::any_io_executor executor_;
  std::string decoy_;
  int waiting_ = 0;
  boost::asio::thread_pool thread_{1};
};

}  // namespace axisd::web
