// Who a client is, by its certificate.
#pragma once

#include <mutex>
#include <string>
#include <string_view>
#include <unordered_map>

namespace axisd::tls {

/// Gives each client one name, and no two clients the same: the common name of its certificate, else the
/// first alternative name (DNS, URI, mail, address), as it is where the first authority of `client_ca` has
/// signed it and it can stand in a log line. Everything else is told apart by a hash of issuer and name:
/// "J??rg~0f3a..." for names with other characters or of other authorities, "unnamed:0f3a..." for
/// certificates without a name. Thread: any.
class Identities {
 public:
  /// `client_ca`: authorities in PEM format, as of Files.
  explicit Identities(const std::string& client_ca);

  /// `pem`: a certificate that was verified. 1 to 128 printable ASCII characters.
  [[nodiscard]] std::string of(const std::string& pem) const;

 private:
  [[nodiscard]] std::string read(const std::string& pem) const;

  std::string first_authority_;  ///< its subject, encoded (DER)
  mutable std::mutex mutex_;
  mutable std::unordered_map<std::string, std::string> known_;  ///< to be asked of each call
};

}  // namespace axisd::tls
