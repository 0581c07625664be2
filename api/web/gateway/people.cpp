#include "api/web/gateway/people.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <boost/asio/post.hpp>

#include "api/web/gateway/passwords.hpp"

namespace axisd::web {

Result<People> People::load(std::string path, bool named) {
  People people(std::move(path));
  people.read_at_ = people.stamp();
  if (named && people.read_at_.size < 0)
    return fail(Reason::invalid_argument,
                fmt::format("{}: the users file that the configuration names is not there", people.path_),
                "axisd-web user add NAME --role ROLE makes it");
  auto users = load_users(people.path_);
  if (!users) return fail(std::move(users).error());
  people.users_ = *std::move(users);
  people.never_anybody_ = people.users_.empty();
  return people;
}

People::Stamp People::stamp() const {
  struct stat about{};
  if (::stat(path_.c_str(), &about) != 0) return {};
  return {.changed_ns = about.st_ctim.tv_sec * 1'000'000'000 + about.st_ctim.tv_nsec,
          .inode = static_cast<std::int64_t>(about.st_ino),
          .size = about.st_size};
}

bool People::refresh() {
  const auto now = stamp();
  if (now == read_at_ || now.size < 0) return false;
  read_at_ = now;
  auto users = load_users(path_);
  if (!users) {
    spdlog::error("{}; what it said before goes on", axisd::to_string(users.error()));
    return false;
  }
  users_ = *std::move(users);
  never_anybody_ = never_anybody_ && users_.empty();
  return true;
}

PasswordWorker::PasswordWorker(boost::asio::any_io_executor executor)
    : executor_(std::move(executor)), decoy_(hash_of_password("a password that nobody has")) {}

bool PasswordWorker::compare(std::string hash, std::string password, std::function<void(bool)> done) {
  if (waiting_ >= most_waiting) return false;
  ++waiting_;
  const bool nobody = hash.empty();
  boost::asio::post(thread_, [this, nobody, hash = nobody ? decoy_ : std::move(hash),
                              password = std::move(password), done = std::move(done)]() mutable {
    const bool fits = password_fits(hash, password) && !nobody;
    boost::asio::post(executor_, [this, fits, done = std::move(done)] {
      --waiting_;
      done(fits);
    });
  });
  return true;
}

}  // namespace axisd::web
