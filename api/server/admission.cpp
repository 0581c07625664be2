#include "api/server/admission.hpp"

#include <fmt/format.h>

#include <utility>

namespace axisd::server {

Result<Admission::Ticket> Admission::admit(const std::string& client, Kind kind) {
  const int limit = kind == Kind::call ? limits_.calls : limits_.streams;
  {
    const std::lock_guard lock(book_->mutex);
    auto& counts = book_->clients[client];
    auto& used = kind == Kind::call ? counts.calls : counts.streams;
    if (used < limit) {
      ++used;
      return Ticket(book_, client, kind);
    }
  }
  return fail(
      Reason::busy,
      fmt::format("{} has {} {} in progress, the most that one client may have", client, limit,
                  kind == Kind::call ? "calls" : "streams"),
      fmt::format("wait for some of them to end, then retry, or raise server.limits.{} in the configuration; "
                  "stops are not limited",
                  kind == Kind::call ? "calls" : "streams"));
}

void Admission::Ticket::release() {
  const auto book = std::exchange(book_, nullptr);
  if (!book) return;
  const std::lock_guard lock(book->mutex);
  const auto found = book->clients.find(client_);
  --(kind_ == Kind::call ? found->second.calls : found->second.streams);
  // Addresses come and go: keep only clients that have something in progress.
  if (found->second.calls == 0 && found->second.streams == 0) book->clients.erase(found);
}

}  // namespace axisd::server
