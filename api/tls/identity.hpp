// Who a client is, by its certificate.
#pragma once

#include <string>
#include <vector>

namespace axisd::tls {

/// One of `client_ca`.
struct Authority {
  std::string name, key;         ///< its subject and its public key, encoded (DER)
  bool shares_its_name = false;  ///< with one of another key
};

/// Gives each client one name, and no two clients the same: the common name of its certificate, else the
/// first alternative name (DNS, URI, mail, address), as it is where the first authority of `client_ca` has
/// signed it and it can stand in a log line. Everything else is told apart by a hash of issuer and name:
/// "J??rg~0f3a..." for names with other characters or of other authorities, "unnamed:0f3a..." for
/// certificates without a name. Authorities are told apart by their keys, too, where they have one name.
/// Thread: any.
class Identities {
 public:
  /// `client_ca`: authorities in PEM format, as of Files.
  explicit Identities(const std::string& client_ca);

  /// `pem`: a certificate that was verified, and behind it those that it came with. 1 to 128 printable ASCII
  /// characters.
  [[nodiscard]] std::string of(const std::string& pem) const;

 private:
  std::vector<Authority> authorities_;
};

}  // namespace axisd::tls
