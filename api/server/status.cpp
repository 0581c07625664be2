#include "api/server/status.hpp"

#include <string>
#include <utility>

#include "api/server/convert.hpp"

namespace axisd::server {
namespace {

// A client accepts 8 KiB of trailers by default and fails the whole call above that; grpc-message may triple
// in size (percent encoding) and the details carry the text again.
constexpr std::size_t longest_message = 512;

std::string clipped(std::string text) {
  if (text.size() <= longest_message) return text;
  auto end = longest_message;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U)
    --end;  // never inside a UTF-8 character
  text.resize(end);
  return text + "...";
}

grpc::Status with_details(grpc::StatusCode code, const Error& error) {
  v1::ErrorDetail detail;
  to_proto(error, detail);
  detail.set_message(clipped(std::move(*detail.mutable_message())));
  detail.set_remedy(clipped(std::move(*detail.mutable_remedy())));
  const auto message = clipped(to_string(error));
  v1::StatusDetails details;
  details.set_code(code);
  details.set_message(message);
  auto& packed = *details.add_details();
  packed.set_type_url("type.googleapis.com/axisd.v1.ErrorDetail");
  packed.set_value(detail.SerializeAsString());
  return {code, message, details.SerializeAsString()};
}

}  // namespace

grpc::StatusCode status_code(Reason reason) {
  switch (reason) {
    case Reason::invalid_argument:
      return grpc::StatusCode::INVALID_ARGUMENT;
    case Reason::out_of_range:
    case Reason::soft_limit:
      return grpc::StatusCode::OUT_OF_RANGE;
    case Reason::unknown_axis:
    case Reason::unknown_command:
      return grpc::StatusCode::NOT_FOUND;
    case Reason::not_supported:
      return grpc::StatusCode::UNIMPLEMENTED;
    case Reason::offline:
    case Reason::no_reply:
    case Reason::bus_down:
    case Reason::storage:
    case Reason::reloading:
      return grpc::StatusCode::UNAVAILABLE;
    case Reason::configuring:
    case Reason::wrong_model:
    case Reason::misconfigured:
    case Reason::disabled:
    case Reason::fault:
    case Reason::stopping:
    case Reason::moving:
    case Reason::inhibited:
    case Reason::state_unaccepted:
    case Reason::not_trusted:
    case Reason::limit_switch:
    case Reason::alarm:
    case Reason::refused:
    // Normally the cause of a command's end. As the answer of a call: look at the machine first.
    case Reason::terminal:
    case Reason::did_not_start:
    case Reason::not_reached:
    case Reason::took_too_long:
    case Reason::not_confirmed:
    case Reason::rebooted:
      return grpc::StatusCode::FAILED_PRECONDITION;
    case Reason::superseded:
    case Reason::lease_lost:
      return grpc::StatusCode::ABORTED;
    case Reason::expired:
      return grpc::StatusCode::DEADLINE_EXCEEDED;
    case Reason::lease_required:
    case Reason::access_denied:
      return grpc::StatusCode::PERMISSION_DENIED;
    case Reason::unauthenticated:
      return grpc::StatusCode::UNAUTHENTICATED;
    case Reason::request_id_conflict:
      return grpc::StatusCode::ALREADY_EXISTS;
    case Reason::busy:
    case Reason::eeprom_budget:
      return grpc::StatusCode::RESOURCE_EXHAUSTED;
    case Reason::cancelled:
      return grpc::StatusCode::CANCELLED;
    case Reason::internal:
      return grpc::StatusCode::INTERNAL;
  }
  return grpc::StatusCode::INTERNAL;
}

grpc::Status to_status(const Error& error) { return with_details(status_code(error.reason), error); }

grpc::Status shutting_down() {
  // Not CANCELLED, which clients take for their own cancellation: UNAVAILABLE makes them reconnect.
  return with_details(grpc::StatusCode::UNAVAILABLE,
                      {.reason = Reason::cancelled,
                       .message = "axisd is shutting down",
                       .remedy = "connect again; ask GetCommand what became of an accepted command",
                       .outcome = Outcome::unknown});
}

}  // namespace axisd::server
