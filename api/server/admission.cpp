#include "api/server/admission.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace axisd::server {
namespace {

using Kind = Admission::Kind;

const Admission::Share& share_of(Kind kind) {
  return *std::ranges::find(Admission::shed_order, kind, &Admission::Share::kind);
}

Error client_has_all(const std::string& client, Kind kind, int limit) {
  const auto* what = kind <= Kind::stream ? "streams" : "calls";
  return {.reason = Reason::busy,
          .message =
              fmt::format("{} has {} {} in progress, the most that one client may have", client, limit, what),
          .remedy = fmt::format("wait for some of them to end, then retry, or raise server.limits.{} in the "
                                "configuration; stops are not limited",
                                what)};
}

Error all_have_too_much(const Admission::Share& share, int taken) {
  return {.reason = Reason::busy,
          .message = fmt::format("the clients have {} calls and streams in progress: no further {} are taken",
                                 taken, share.name),
          .remedy = "retry in a moment, or find out who has so many; stops are not limited"};
}

}  // namespace

Result<Admission::Ticket> Admission::admit(const std::string& client, Kind kind) {
  const int limit = kind <= Kind::stream ? limits_.streams : limits_.calls;
  const auto& share = share_of(kind);
  const std::lock_guard lock(book_->mutex);
  const auto known = book_->clients.find(client);
  const int used = known == book_->clients.end() ? 0 : known->second.of(kind);
  if (used >= limit) return fail(client_has_all(client, kind, limit));
  const int own = kind == Kind::motion ? own_calls : kind >= Kind::stream ? 1 : 0;
  if (used >= own && book_->taken >= limits_.all * share.percent / 100)
    return fail(all_have_too_much(share, book_->taken));
  ++book_->clients[client].of(kind);
  ++book_->taken;
  return Ticket(book_, client, kind);
}

void Admission::Ticket::release() {
  const auto book = std::exchange(book_, nullptr);
  if (!book) return;
  const std::lock_guard lock(book->mutex);
  const auto found = book->clients.find(client_);
  --found->second.of(kind_);
  --book->taken;
  // Addresses come and go: keep only clients that have something in progress.
  if (found->second.calls == 0 && found->second.streams == 0) book->clients.erase(found);
}

}  // namespace axisd::server
