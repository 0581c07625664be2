#include "api/server/audit_service.hpp"

#include <fmt/format.h>

#include <memory>
#include <utility>

#include "api/server/audit_convert.hpp"
#include "api/server/convert.hpp"
#include "api/server/pending_call.hpp"
#include "api/server/status.hpp"
#include "api/server/value_reply.hpp"

namespace axisd::server {
namespace {

constexpr int usual_records = 100, most_records = 500;
/// Of the records in one answer, about: a client takes no message beyond 4 MiB.
constexpr std::size_t most_bytes = std::size_t{1} << 20U;

Result<WallTime> since(const v1::ListAuditRequest& request) {
  if (!request.has_since()) return WallTime{};
  const auto time = from_proto(request.since());
  if (time) return *time;
  return fail(Reason::invalid_argument, "since is no time", "leave it out, or give a time of the wall clock");
}

/// Gathers what passes the filter, on the thread that reads.
class Gathering {
 public:
  Gathering(const v1::ListAuditRequest& request, int limit) : filter_(request), limit_(limit) {}

  bool take(std::string_view line) {
    auto record = audit_record(line);
    if (!record || !filter_.passes(*record)) return true;
    bytes_ += line.size();
    *page_.add_records() = *std::move(record);
    return page_.records_size() < limit_ && bytes_ < most_bytes;
  }
  v1::ListAuditResponse finish(const AuditSeen& seen) {
    page_.set_cursor(seen.cursor);
    page_.set_newest(seen.newest);
    page_.set_oldest(seen.oldest);
    return std::move(page_);
  }

 private:
  AuditFilter filter_;
  int limit_;
  std::size_t bytes_ = 0;
  v1::ListAuditResponse page_;
};

}  // namespace

AuditServiceImpl::AuditServiceImpl(const Services& services) : BoundedService(services), services_(services) {
  begin_within_bounds(&AuditServiceImpl::ListAudit);
}

grpc::ServerUnaryReactor* AuditServiceImpl::ListAudit(Context* context, const v1::ListAuditRequest* request,
                                                      v1::ListAuditResponse* response) {
  if (request->limit() > most_records)
    return answer(context, to_status({.reason = Reason::out_of_range,
                                      .message = fmt::format("limit is {}", request->limit()),
                                      .remedy = "ask for fewer, and go on with the cursor",
                                      .permitted = Range{.minimum = 0, .maximum = most_records}}));
  const auto from = since(*request);
  if (!from) return answer(context, to_status(from.error()));
  auto ticket = services_.admission.admit(client_of(*context), Admission::Kind::read);
  if (!ticket) return answer(context, to_status(ticket.error()));
  if (services_.audit == nullptr)
    return answer(context, to_status({.reason = Reason::not_supported,
                                      .message = "this server keeps no audit",
                                      .remedy = "ask the daemon itself"}));
  return PendingCall::start(
      services_, context, *std::move(ticket), [&](const std::shared_ptr<PendingCall>& call) {
        const auto limit = request->limit() == 0 ? usual_records : static_cast<int>(request->limit());
        auto gathering = std::make_shared<Gathering>(*request, limit);
        using Page = v1::ListAuditResponse;
        auto reply = reply_with_value<Page>(call, [response](const Page& page) { *response = page; });
        services_.audit->look(
            request->after_number(), *from,
            [gathering](std::string_view line) { return gathering->take(line); },
            [gathering, reply = std::move(reply)](const Result<AuditSeen>& seen) {
              reply(seen ? Result<Page>(gathering->finish(*seen)) : Result<Page>(fail(seen.error())));
            });
      });
}

}  // namespace axisd::server
