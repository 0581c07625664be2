#pragma once

namespace axisd::tls {

/// OpenSSL stays whole until the process is gone: a thread of gRPC that ends after main has still something
/// to give back. First of all in main.
void keep_library_for_threads();

}  // namespace axisd::tls
