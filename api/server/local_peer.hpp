// Who is at the other end of a unix socket.
#pragma once

#include "api/server/access.hpp"

namespace axisd::server {

/// The user ("unix:anna") and the program that made the connection, as the kernel knows them (SO_PEERCRED).
/// The program is no part of the name: it calls itself as it likes, and the programs of one user work under
/// each other's leases. A user that /etc/passwd does not name goes by number: no directory service is asked,
/// because nobody waits for one here. A user that was renamed may go by the old name for
/// UserNames::longest.
[[nodiscard]] Peer local_peer(int connection);

}  // namespace axisd::server
