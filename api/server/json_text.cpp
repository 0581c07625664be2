#include "api/server/json_text.hpp"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/duration.pb.h>
#include <google/protobuf/timestamp.pb.h>
#include <google/protobuf/util/time_util.h>

#include <array>
#include <boost/json.hpp>
#include <boost/locale/utf.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

namespace axisd::server {
namespace {

namespace json = boost::json;
namespace pb = google::protobuf;
using Field = pb::FieldDescriptor;
using Time = pb::util::TimeUtil;

/// Most records fit; of what does not, the rest is allocated.
constexpr std::size_t usual_bytes = std::size_t{16} * 1024;
/// From there on protobuf writes whole numbers with an exponent, too.
constexpr double longest_integer = 1e15;

bool is_utf8(const std::string& text) {
  using Utf8 = boost::locale::utf::utf_traits<char>;
  for (auto at = text.begin(); at != text.end();)
    if (!boost::locale::utf::is_valid_codepoint(Utf8::decode(at, text.end()))) return false;
  return true;
}

/// Fields of messages as values of JSON, in memory of `storage`.
class Printer {
 public:
  explicit Printer(json::storage_ptr storage) : storage_(std::move(storage)) {}
  [[nodiscard]] json::value object(const pb::Message& message);
  /// Something had no text.
  [[nodiscard]] bool failed() const { return failed_; }

 private:
  [[nodiscard]] json::value array(const pb::Message& message, const Field& field);
  [[nodiscard]] json::value entry(const pb::Message& message, const Field& field, int index);
  [[nodiscard]] json::value submessage(const pb::Message& message);
  [[nodiscard]] json::value time(const pb::Timestamp& time);
  [[nodiscard]] json::value duration(const pb::Duration& duration);
  [[nodiscard]] json::value text(const std::string& text);
  [[nodiscard]] json::value name(const pb::EnumDescriptor& type, int number);
  [[nodiscard]] json::value real(double value);
  /// A number of 64 bit is a text: readers of JSON may hold numbers as double.
  [[nodiscard]] json::value quoted(auto value) {
    return json::value(fmt::format_int(value).c_str(), storage_);
  }
  [[nodiscard]] json::value number(auto value) { return json::value(value, storage_); }
  [[nodiscard]] json::value fail() {
    failed_ = true;
    return json::value(nullptr, storage_);
  }

  json::storage_ptr storage_;
  bool failed_ = false;
};

json::value Printer::object(const pb::Message& message) {
  const auto& type = *message.GetDescriptor();
  const auto& reflection = *message.GetReflection();
  json::object result(storage_);
  for (int i = 0; i < type.field_count(); ++i) {
    const auto& field = *type.field(i);
    if (field.is_repeated()) {
      if (reflection.FieldSize(message, &field) > 0) result.emplace(field.name(), array(message, field));
    } else if (reflection.HasField(message, &field)) {
      result.emplace(field.name(), entry(message, field, -1));
    }
  }
  return json::value(std::move(result), storage_);
}

json::value Printer::array(const pb::Message& message, const Field& field) {
  if (field.is_map()) return fail();
  json::array result(storage_);
  const int size = message.GetReflection()->FieldSize(message, &field);
  result.reserve(static_cast<std::size_t>(size));
  for (int i = 0; i < size; ++i) result.push_back(entry(message, field, i));
  return json::value(std::move(result), storage_);
}

/// `index`: -1: the field is not repeated.
json::value Printer::entry(const pb::Message& message, const Field& field, int index) {
  const auto& of = *message.GetReflection();
  const bool one = index < 0;
  std::string scratch;
  switch (field.cpp_type()) {
    case Field::CPPTYPE_INT32:
      return number(one ? of.GetInt32(message, &field) : of.GetRepeatedInt32(message, &field, index));
    case Field::CPPTYPE_UINT32:
      return number(one ? of.GetUInt32(message, &field) : of.GetRepeatedUInt32(message, &field, index));
    case Field::CPPTYPE_INT64:
      return quoted(one ? of.GetInt64(message, &field) : of.GetRepeatedInt64(message, &field, index));
    case Field::CPPTYPE_UINT64:
      return quoted(one ? of.GetUInt64(message, &field) : of.GetRepeatedUInt64(message, &field, index));
    case Field::CPPTYPE_BOOL:
      return number(one ? of.GetBool(message, &field) : of.GetRepeatedBool(message, &field, index));
    case Field::CPPTYPE_DOUBLE:
      return real(one ? of.GetDouble(message, &field) : of.GetRepeatedDouble(message, &field, index));
    case Field::CPPTYPE_ENUM:
      return name(*field.enum_type(),
                  one ? of.GetEnumValue(message, &field) : of.GetRepeatedEnumValue(message, &field, index));
    case Field::CPPTYPE_STRING:
      if (field.type() != Field::TYPE_STRING) return fail();
      return text(one ? of.GetStringReference(message, &field, &scratch)
                      : of.GetRepeatedStringReference(message, &field, index, &scratch));
    case Field::CPPTYPE_MESSAGE:
      return submessage(one ? of.GetMessage(message, &field) : of.GetRepeatedMessage(message, &field, index));
    case Field::CPPTYPE_FLOAT:
      return fail();
  }
  return fail();
}

json::value Printer::submessage(const pb::Message& message) {
  const auto* type = message.GetDescriptor();
  if (type == pb::Timestamp::descriptor()) return time(static_cast<const pb::Timestamp&>(message));
  if (type == pb::Duration::descriptor()) return duration(static_cast<const pb::Duration&>(message));
  return type->file()->package() == "google.protobuf" ? fail() : object(message);
}

json::value Printer::time(const pb::Timestamp& time) {
  const bool has_text = time.seconds() >= Time::kTimestampMinSeconds &&
                        time.seconds() <= Time::kTimestampMaxSeconds && time.nanos() >= 0 &&
                        time.nanos() < 1'000'000'000;
  return has_text ? text(Time::ToString(time)) : fail();
}

json::value Printer::duration(const pb::Duration& duration) {
  const bool one_sign =
      duration.seconds() == 0 || duration.nanos() == 0 || (duration.seconds() < 0) == (duration.nanos() < 0);
  const bool has_text = duration.seconds() >= Time::kDurationMinSeconds &&
                        duration.seconds() <= Time::kDurationMaxSeconds &&
                        std::abs(std::int64_t{duration.nanos()}) < 1'000'000'000 && one_sign;
  return has_text ? text(Time::ToString(duration)) : fail();
}

json::value Printer::text(const std::string& text) {
  if (!is_utf8(text)) return fail();
  return json::value(json::string_view(text), storage_);
}

/// A number that the contract does not name stays a number.
json::value Printer::name(const pb::EnumDescriptor& type, int number) {
  const auto* value = type.FindValueByNumber(number);
  return value == nullptr ? this->number(number) : text(value->name());
}

json::value Printer::real(double value) {
  if (std::isnan(value)) return text("NaN");
  if (std::isinf(value)) return text(value > 0 ? "Infinity" : "-Infinity");
  const bool is_integer =
      std::trunc(value) == value && std::abs(value) < longest_integer && !(value == 0 && std::signbit(value));
  return is_integer ? number(static_cast<std::int64_t>(value)) : number(value);
}

}  // namespace

std::optional<std::string> json_text(const pb::Message& message) {
  std::array<unsigned char, usual_bytes> usual;  // NOLINT(*-member-init): 16 KiB that need no zeros
  json::monotonic_resource memory(usual.data(), usual.size());
  Printer printer(&memory);
  const auto value = printer.object(message);
  if (printer.failed()) return std::nullopt;
  return json::serialize(value);
}

}  // namespace axisd::server
