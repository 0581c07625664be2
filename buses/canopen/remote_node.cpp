#include "buses/canopen/remote_node.hpp"

#include <fmt/format.h>

#include <utility>

#include "buses/canopen/sdo_abort.hpp"

namespace axisd::canopen {

namespace {

constexpr Object device_type{0x1000, 0};
constexpr std::uint16_t identity_index = 0x1018;

template <class T>
void append(std::string& text, const char* name, const std::optional<T>& value, const char* format) {
  if (value)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, fmt::format(fmt::runtime(format), *value));
}

template <class Who>
std::string described(std::optional<std::uint16_t> profile, const Who& who) {
  std::string text;
  append(text, "profile", profile, "{}");
  append(text, "vendor", who.vendor, "0x{:08X}");
  append(text, "product", who.product, "0x{:08X}");
  append(text, "revision", who.revision, "0x{:08X}");
  append(text, "serial number", who.serial, "0x{:08X}");
  return text.empty() ? "anything" : text;
}

template <class T>
bool fits(const std::optional<T>& found, const std::optional<T>& expected) {
  return !expected || found == expected;
}

}  // namespace

Task<Result<std::uint64_t>> RemoteNode::read(Object object, SdoOptions options) const {
  auto answer = co_await sdo_->upload(id_, object, std::move(options));
  if (!answer) co_return fail(std::move(answer.error()));
  co_return number_of(answer->bytes);
}

Task<Result<std::optional<std::uint64_t>>> RemoteNode::read_if_there(Object object,
                                                                     SdoOptions options) const {
  auto value = co_await read(object, std::move(options));
  if (value) co_return std::optional(*value);
  if (is_missing(value.error())) co_return std::optional<std::uint64_t>{};
  co_return fail(std::move(value.error()));
}

Task<Result<void>> RemoteNode::write(Object object, std::uint64_t value, std::size_t size,
                                     SdoOptions options) const {
  auto answer = co_await sdo_->download(id_, object, number_bytes(value, size), std::move(options));
  if (!answer) co_return fail(std::move(answer.error()));
  co_return Result<void>{};
}

std::string to_string(const Identity& identity) {
  return described(std::optional(identity.profile()), identity);
}
std::string to_string(const ExpectedIdentity& expected) { return described(expected.profile, expected); }

Task<Result<Identity>> read_identity(RemoteNode node, SdoOptions options) {
  const auto type = co_await node.read(device_type, options);
  if (!type) co_return fail(type.error());
  Identity identity{.device_type = static_cast<std::uint32_t>(*type)};
  // Sub 0 is no proof that a sub-index is there: the YSS-C's counts 3 and lists 2 (chapter 7).
  const auto count = co_await node.read_if_there({identity_index, 0}, options);
  if (!count) co_return fail(count.error());
  std::uint8_t sub = 0;
  for (auto* part : {&identity.vendor, &identity.product, &identity.revision, &identity.serial}) {
    if (++sub > count->value_or(0)) break;
    const auto value = co_await node.read_if_there({identity_index, sub}, options);
    if (!value) co_return fail(value.error());
    if (*value) *part = static_cast<std::uint32_t>(**value);
  }
  co_return identity;
}

Result<void> check_identity(const Identity& found, const ExpectedIdentity& expected) {
  if (fits(std::optional(found.profile()), expected.profile) && fits(found.vendor, expected.vendor) &&
      fits(found.product, expected.product) && fits(found.revision, expected.revision) &&
      fits(found.serial, expected.serial))
    return {};
  return fail(Reason::wrong_model,
              fmt::format("expected {}, but the node says {}", to_string(expected), to_string(found)),
              "correct the model or the node-ID in the configuration, or the drive's address switches");
}

}  // namespace axisd::canopen
