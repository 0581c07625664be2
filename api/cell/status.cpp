#include "api/cell/status.hpp"

#include <fmt/format.h>

#include <utility>

#include "config/text.hpp"

namespace axisd::cell {
namespace {

constexpr std::size_t longest_text = 512;
constexpr std::string_view type = "type.googleapis.com/axisd.v1.ErrorDetail";

axisd::v1::Reason reason_of(grpc::StatusCode code) {
  switch (code) {
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return axisd::v1::REASON_OFFLINE;
    case grpc::StatusCode::UNIMPLEMENTED:
      return axisd::v1::REASON_NOT_SUPPORTED;
    case grpc::StatusCode::PERMISSION_DENIED:
      return axisd::v1::REASON_ACCESS_DENIED;
    case grpc::StatusCode::UNAUTHENTICATED:
      return axisd::v1::REASON_UNAUTHENTICATED;
    default:
      return axisd::v1::REASON_INTERNAL;
  }
}

}  // namespace

axisd::v1::ErrorDetail detail_of(axisd::v1::Reason reason, std::string message, std::string remedy) {
  axisd::v1::ErrorDetail detail;
  detail.set_reason(reason);
  detail.set_message(std::move(message));
  detail.set_remedy(std::move(remedy));
  detail.set_outcome(axisd::v1::OUTCOME_NOT_SENT);
  return detail;
}

grpc::Status to_status(grpc::StatusCode code, const axisd::v1::ErrorDetail& detail) {
  const auto text = config::printable(
      detail.remedy().empty() ? detail.message() : fmt::format("{}; {}", detail.message(), detail.remedy()),
      longest_text);
  axisd::v1::StatusDetails details;
  details.set_code(code);
  details.set_message(text);
  auto& packed = *details.add_details();
  packed.set_type_url(type.data(), type.size());
  packed.set_value(detail.SerializeAsString());
  return {code, text, details.SerializeAsString()};
}

grpc::Status to_status(grpc::StatusCode code, axisd::v1::Reason reason, std::string message,
                       std::string remedy) {
  return to_status(code, detail_of(reason, std::move(message), std::move(remedy)));
}

axisd::v1::ErrorDetail detail_of(const grpc::Status& status) {
  axisd::v1::StatusDetails details;
  if (details.ParseFromString(status.error_details()))
    for (const auto& packed : details.details()) {
      axisd::v1::ErrorDetail detail;
      if (packed.type_url() == type && detail.ParseFromString(packed.value())) return detail;
    }
  auto detail =
      detail_of(reason_of(status.error_code()), config::printable(status.error_message(), longest_text), "");
  // It may have been done, where nobody said that it was not.
  detail.set_outcome(axisd::v1::OUTCOME_UNKNOWN);
  return detail;
}

axisd::v1::ErrorDetail named(axisd::v1::ErrorDetail detail, const std::string& machine) {
  detail.set_message(fmt::format("{}: {}", machine, detail.message()));
  return detail;
}

axisd::v1::ErrorDetail detail_of(const Error& error) {
  return detail_of(axisd::v1::REASON_STORAGE, error.message, error.remedy);
}

}  // namespace axisd::cell
