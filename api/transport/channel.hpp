// How this house's programs connect to a daemon.
#pragma once

#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>

#include <memory>
#include <string>
#include <string_view>

#include "buses/error.hpp"

namespace axisd::transport {

/// Of every channel to a daemon, or to the entrance of a cell.
[[nodiscard]] grpc::ChannelArguments client_arguments();

/// Paths of PEM files.
struct ClientFiles {
  std::string ca;                ///< empty: without TLS
  std::string certificate, key;  ///< both or none
};
/// Blocks for the disk. `section`: of the configuration, for errors. Errors: invalid_argument (a file that
/// cannot be read).
[[nodiscard]] Result<std::shared_ptr<grpc::ChannelCredentials>> client_credentials(const ClientFiles& files,
                                                                                   std::string_view section);

}  // namespace axisd::transport
