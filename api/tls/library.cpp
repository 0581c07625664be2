#include "api/tls/library.hpp"

#include <openssl/crypto.h>

namespace axisd::tls {

void keep_library_for_threads() { OPENSSL_init_crypto(OPENSSL_INIT_NO_ATEXIT, nullptr); }

}  // namespace axisd::tls
