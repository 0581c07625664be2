// Who says who somebody is: the seam for other ways to log in.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <optional>
#include <string>

#include "api/web/gateway/people.hpp"
#include "api/web/gateway/person.hpp"

namespace axisd::web {

/// What a page sends to log in.
struct Credentials {
  std::string name, secret;
};

/// Somebody who may come in. `proof`: what the authority knows a session by that it began.
struct Admitted {
  Person person;
  std::string proof;
};

/// Decides who logs in, and whether a session that has begun still stands. The gateway knows no other way to
/// a session; a role it gives to nobody: it tells the daemon what the authority says. Thread: the gateway's.
class Authority {
 public:
  /// Nothing: it is not who it says.
  using Answer = std::function<void(std::optional<Admitted>)>;

  virtual ~Authority() = default;
  /// False: too many wait. `answer` is called later, once, and takes as long whether or not there is such a
  /// person.
  [[nodiscard]] virtual bool ask(const Credentials& credentials, Answer answer) = 0;
  /// Whether who was admitted by that proof would still be, with the same role. Asked every second.
  [[nodiscard]] virtual bool stands(const Person& person, const std::string& proof) const = 0;
};

/// The users file, and passwords. Outlived by `people`.
class PasswordAuthority final : public Authority {
 public:
  PasswordAuthority(const People& people, boost::asio::any_io_executor executor)
      : people_(people), passwords_(std::move(executor)) {}
  bool ask(const Credentials& credentials, Answer answer) override;
  bool stands(const Person& person, const std::string& proof) const override;

 private:
  const People& people_;
  PasswordWorker passwords_;
};

}  // namespace axisd::web
