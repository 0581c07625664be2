#include "api/tls/file_watch.hpp"

#include <sys/stat.h>

namespace axisd::tls {

bool FileWatch::settled() {
  auto now = look();
  const bool still = now == last_;
  last_ = std::move(now);
  if (!still || last_ == told_) return false;
  told_ = last_;
  return true;
}

FileWatch::Signature FileWatch::look() const {
  Signature signature;
  for (const auto& path : paths_) {
    struct stat status{};
    if (stat(path.c_str(), &status) != 0) status = {};
    signature.push_back({static_cast<std::int64_t>(status.st_dev), static_cast<std::int64_t>(status.st_ino),
                         static_cast<std::int64_t>(status.st_size), status.st_mtim.tv_sec,
                         status.st_mtim.tv_nsec, status.st_ctim.tv_sec, status.st_ctim.tv_nsec});
  }
  return signature;
}

}  // namespace axisd::tls
