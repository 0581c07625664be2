// Who calls the entrance.
#pragma once

#include <grpcpp/server_context.h>

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "api/cell/ask.hpp"
#include "api/cell/settings.hpp"
#include "api/tls/live.hpp"

namespace axisd::cell {

struct Caller {
  std::string name;  ///< of the certificate; "local" of this computer
  bool local = false;
  CellRole role = CellRole::viewer;  ///< of a certificate
  /// Why nothing is taken from it: its certificate is not, or no longer, good.
  std::optional<Error> refusal{};
};

/// By its certificate. Without TLS, which is on loopback alone, everybody is the entrance itself: who may
/// move what is then what its own certificate may. Thread: any.
class Callers {
 public:
  /// `live`: nullptr: there is no TLS.
  Callers(std::shared_ptr<const tls::Live> live, const Settings& settings)
      : live_(std::move(live)), settings_(settings) {}

  [[nodiscard]] Caller of(const grpc::ServerContextBase& context) const;
  /// Whether it is an entrance of this cell, by the name that all of them show: "cell.CELL".
  [[nodiscard]] bool is_entrance(const Caller& caller) const;
  /// What a machine is told of whom a call is for. A name that no axisd takes is nobody's: nothing.
  [[nodiscard]] static std::optional<Metadata> metadata_for(const Caller& caller);

 private:
  const std::shared_ptr<const tls::Live> live_;
  const Settings& settings_;
};

/// The value of a key of a call's metadata; nothing: it has none.
[[nodiscard]] std::optional<std::string_view> metadata_of(const grpc::ServerContextBase& context,
                                                          std::string_view key);

}  // namespace axisd::cell
