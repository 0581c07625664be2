#include "api/axisctl/error.hpp"

#include <fmt/format.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <cstdio>
#include <utility>

#include "api/axisctl/advice.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/machine_names.hpp"

namespace axisd::axisctl {
namespace {

constexpr std::string_view detail_type = "axisd.v1.ErrorDetail";

/// gRPC's text for a failed connection is a list of wrapped errors, the last one being the reason.
std::string_view innermost(std::string_view text) {
  constexpr std::string_view mark = "last error: ";
  if (const auto at = text.rfind(mark); at != text.npos) text.remove_prefix(at + mark.size());
  // Its resolver tells of its libraries before it comes to the point.
  constexpr std::string_view resolver = "is_balancer=0: ";
  if (const auto at = text.rfind(resolver); at != text.npos) text.remove_prefix(at + resolver.size());
  for (const std::string_view noise : {"UNKNOWN: ", "UNAVAILABLE: ", "INTERNAL: "})
    if (text.starts_with(noise)) text.remove_prefix(noise.size());
  return text;
}

/// gRPC's words for a call that never had a connection.
bool never_connected(std::string_view message) {
  // The last one: no connection can be made with the pair of certificate and key.
  return message.starts_with("failed to connect") || message.starts_with("DNS resolution failed") ||
         message.starts_with("empty address list");
}

/// The daemon's end cut the call off: what it was to do may have been accepted.
bool cut_off(const grpc::Status& status, const v1::ErrorDetail& detail) {
  return status.error_code() == grpc::StatusCode::UNAVAILABLE && detail.reason() == v1::REASON_CANCELLED;
}

/// The entrance's word for a machine that does not answer; of a drive the bus and the node are told as well.
bool is_silent_machine(const grpc::Status& status, const v1::ErrorDetail& detail, Asked asked) {
  return asked == Asked::entrance && status.error_code() == grpc::StatusCode::UNAVAILABLE &&
         detail.reason() == v1::REASON_OFFLINE && detail.bus().empty() && !detail.has_node();
}

std::string_view program(Asked asked) { return asked == Asked::entrance ? "axisd-cell" : "axisd"; }

std::string_view remedy_of(std::string_view reason, bool tls, Asked asked) {
  const bool refused = reason.contains("refused") || reason.contains("No such file");
  if (asked == Asked::entrance)
    return refused ? "is it running there? --cell HOST:PORT or AXISD_CELL names another entrance, --server a "
                     "machine itself"
           : tls
               ? "check the certificates (--tls-ca, --tls-cert, --tls-key) and the address"
               : "check the address (--cell); an entrance with TLS needs --tls-ca, --tls-cert and --tls-key";
  return refused ? "is the daemon running there? --server HOST:PORT or AXISD_SERVER names another one"
         : tls   ? "check the certificates (--tls-ca, --tls-cert, --tls-key) and the address"
                 : "check the address (--server); a daemon with TLS needs --tls-ca, --tls-cert and --tls-key";
}

Failure unreachable(const grpc::Status& status, std::string_view server, bool tls, Asked asked) {
  const std::string message = status.error_message();
  const std::string_view reason = innermost(message);
  if (!never_connected(message))
    return {ExitCode::unreachable,
            fmt::format("lost {}{} at {}: {}; what it has done is not known",
                        asked == Asked::entrance ? "the machine, or " : "", program(asked), server, reason)};
  return {ExitCode::unreachable,
          fmt::format("cannot reach {} at {}: {}; {}", program(asked), server, reason,
                      remedy_of(reason, tls, asked)),
          true};
}

/// In the words of the daemon's log.
std::string object_text(std::uint32_t object) {
  return fmt::format("{} {}", object <= 0xFFFF ? "register" : "object", address_text(object));
}

std::string own_reason(ExitCode code) {
  switch (code) {
    case ExitCode::usage:
      return "USAGE";
    case ExitCode::unreachable:
      return "UNREACHABLE";
    case ExitCode::refused:
      return "REFUSED";
    case ExitCode::interrupted:
      return "INTERRUPTED";
    case ExitCode::ok:
    case ExitCode::ended_otherwise:
      break;
  }
  return "FAILED";
}

using Fields = google::protobuf::Map<std::string, google::protobuf::Value>;

/// Of a failure of this program: its line says what is wrong, and behind the last semicolon what to do.
void add_own(Fields& fields, const Failure& failure) {
  const std::string_view text = failure.what();
  const auto end = text.rfind("; ");
  fields["reason"].set_string_value(own_reason(failure.code()));
  fields["message"].set_string_value(std::string(text.substr(0, end)));
  fields["remedy"].set_string_value(end == text.npos ? "" : std::string(text.substr(end + 2)));
  if (failure.code() == ExitCode::unreachable)
    fields["outcome"].set_string_value(
        v1::Outcome_Name(failure.nothing_sent() ? v1::OUTCOME_NOT_SENT : v1::OUTCOME_UNKNOWN));
}

}  // namespace

Failure Failure::saying(const std::string& text) const {
  Failure failure(code_, text, nothing_sent_);
  failure.detail_ = detail_;
  return failure;
}

std::string error_json(const Failure& failure) {
  google::protobuf::Struct error, line;
  auto& fields = *error.mutable_fields();
  if (!failure.detail() || !google::protobuf::util::JsonStringToMessage(json(*failure.detail()), &error).ok())
    add_own(fields, failure);
  fields["exit_status"].set_number_value(std::to_underlying(failure.code()));
  fields["text"].set_string_value(failure.what());
  *(*line.mutable_fields())["error"].mutable_struct_value() = std::move(error);
  return json(line);
}

void complain(const Failure& failure, bool as_json) {
  fmt::print(stderr, "{}\n", as_json ? error_json(failure) : fmt::format("axisctl: {}", failure.what()));
}

std::optional<v1::ErrorDetail> detail_of(const grpc::Status& status) {
  v1::StatusDetails details;
  if (status.error_details().empty() || !details.ParseFromString(status.error_details())) return std::nullopt;
  for (const auto& packed : details.details()) {
    const std::string_view type = packed.type_url();
    if (type.substr(type.rfind('/') + 1) != detail_type) continue;
    if (v1::ErrorDetail detail; detail.ParseFromString(packed.value())) return detail;
  }
  return std::nullopt;
}

std::string describe(const v1::ErrorDetail& detail, std::string_view subject) {
  std::string message = in_own_words(detail.message());
  // Of an axis of a cell a machine says its own name, and the entrance that of the machine.
  for (const auto& name : {subject, without_machine(subject), machine_in(subject)})
    if (const std::string lead = fmt::format("{}: ", name); message.starts_with(lead))
      message.erase(0, lead.size());
  std::string text;
  if (!detail.bus().empty()) text = detail.bus();
  if (detail.has_node()) text += fmt::format("{}node {}", text.empty() ? "" : " ", detail.node());
  if (detail.has_object()) text += fmt::format("{}{}", text.empty() ? "" : " ", object_text(detail.object()));
  if (!text.empty()) text += ": ";
  text += message.empty() ? lower_word(v1::Reason_Name(detail.reason()), "REASON_") : message;
  if (detail.has_permitted() && !message.contains("permitted"))
    text += fmt::format(" (permitted {} to {}{}{})", number(detail.permitted().minimum()),
                        number(detail.permitted().maximum()), detail.permitted().unit().empty() ? "" : " ",
                        detail.permitted().unit());
  if (!detail.remedy().empty()) text += "; " + advice(detail.remedy(), subject);
  return text;
}

Failure failure_of(const grpc::Status& status, std::string_view subject, std::string_view server, bool tls,
                   Asked asked) {
  const std::string lead = subject.empty() ? "" : fmt::format("{}: ", subject);
  if (const auto detail = detail_of(status)) {
    const bool silent = is_silent_machine(status, *detail, asked);
    return {silent || cut_off(status, *detail) ? ExitCode::unreachable : ExitCode::refused,
            lead + describe(*detail, subject), *detail, silent && detail->outcome() == v1::OUTCOME_NOT_SENT};
  }
  if (status.error_code() == grpc::StatusCode::UNAVAILABLE) return unreachable(status, server, tls, asked);
  if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED)
    return {ExitCode::unreachable,
            fmt::format("{}no answer from {} at {} in time; --timeout sets how long to wait", lead,
                        program(asked), server)};
  if (status.error_code() == grpc::StatusCode::UNIMPLEMENTED && asked == Asked::entrance)
    return {
        ExitCode::refused,
        fmt::format(
            "{}{} is no entrance of a cell, or is of another version than this axisctl; an axisd is called "
            "by --server",
            lead, server)};
  if (status.error_code() == grpc::StatusCode::UNIMPLEMENTED)
    return {ExitCode::refused, fmt::format("{}the daemon at {} does not offer this function: {}; compare the "
                                           "versions of both (axisctl info, axisctl --version)",
                                           lead, server, status.error_message())};
  const std::string text = status.error_message().empty()
                               ? fmt::format("the call failed with gRPC status {}", int{status.error_code()})
                               : status.error_message();
  return {ExitCode::refused, lead + text};
}

}  // namespace axisd::axisctl
