#include "api/tls/live.hpp"

namespace axisd::tls {

Result<std::shared_ptr<Live>> Live::open(Files paths, WallTime now) {
  std::shared_ptr<Live> live(new Live(std::move(paths)));
  if (auto loaded = live->reload(now); !loaded) return fail(std::move(loaded).error());
  return live;
}

std::shared_ptr<const Generation> Live::served() const {
  const std::lock_guard lock(mutex_);
  return served_;
}

Result<bool> Live::reload(WallTime now) {
  const std::lock_guard one_at_a_time(reloading_);
  auto contents = read(paths_, now);
  if (!contents) return fail(std::move(contents).error());
  const auto before = served();
  if (before && before->contents == *contents) return false;
  auto acceptor = Acceptor::make(*contents);
  if (!acceptor) return fail(std::move(acceptor).error());
  const auto number = before ? before->number + 1 : 1;
  // Aggregates with such members are made in place.
  std::shared_ptr<const Generation> next(new Generation{
      .number = number, .contents = *contents, .acceptor = *acceptor, .clients = Clients(*contents)});
  const std::lock_guard lock(mutex_);
  served_ = std::move(next);
  return true;
}

}  // namespace axisd::tls
