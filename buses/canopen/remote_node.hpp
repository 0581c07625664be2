// One node of a network as drive code sees it: typed access to its objects, and who it is.
#pragma once

#include <optional>
#include <string>

#include "buses/canopen/sdo_client.hpp"

namespace axisd::canopen {

/// Thread: core.
class RemoteNode {
 public:
  RemoteNode(SdoClient& sdo, std::uint8_t id) : sdo_(&sdo), id_(id) {}

  /// The number that an object of up to 8 bytes holds; sign_extended() makes it a signed one.
  Task<Result<std::uint64_t>> read(Object object, SdoOptions options = {}) const;
  /// The same, but nothing where the node has no such object.
  Task<Result<std::optional<std::uint64_t>>> read_if_there(Object object, SdoOptions options = {}) const;
  /// Writes the lowest `size` bytes (1..8) of `value`.
  Task<Result<void>> write(Object object, std::uint64_t value, std::size_t size,
                           SdoOptions options = {}) const;

  [[nodiscard]] std::uint8_t id() const { return id_; }
  [[nodiscard]] SdoClient& sdo() const { return *sdo_; }

 private:
  SdoClient* sdo_;
  std::uint8_t id_;
};

/// What a node says of itself: 1000h and 1018h. Absent: the node lacks the object.
struct Identity {
  std::uint32_t device_type = 0;  ///< low 16 bits: profile (402)
  std::optional<std::uint32_t> vendor{}, product{}, revision{}, serial{};
  [[nodiscard]] std::uint16_t profile() const { return static_cast<std::uint16_t>(device_type); }
};
/// "profile 402, vendor 0x00000100, product 0x00000003"
std::string to_string(const Identity& identity);

/// Unset parts are not compared.
struct ExpectedIdentity {
  std::optional<std::uint16_t> profile{};
  std::optional<std::uint32_t> vendor{}, product{}, revision{}, serial{};
};
std::string to_string(const ExpectedIdentity& expected);

Task<Result<Identity>> read_identity(RemoteNode node, SdoOptions options = {});
/// wrong_model, naming both. Pure.
Result<void> check_identity(const Identity& found, const ExpectedIdentity& expected);

}  // namespace axisd::canopen
