#pragma once

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <thread>

#include "config/configuration.hpp"
#include "daemon/bounded_worker.hpp"
#include "daemon/core/reload.hpp"
#include "devices/configuration_access.hpp"

namespace axisd {

/// Of the text of a configuration: equal texts have equal ones.
[[nodiscard]] std::string revision_of(std::string_view yaml);

/// The file that the daemon serves, and the loader that judges others like it. Reloads are made one at a time
/// on a thread of its own, because they read files and wait for the machine; what only looks at files has
/// another one, so that no reload waits for it. Thread: any.
class ConfigurationService final : public ConfigurationAccess {
 public:
  struct Parts {
    std::string path;                     ///< as the daemon was given it
    std::string yaml;                     ///< what was read there
    config::Configuration configuration;  ///< and what that means
    WallTime since{};
    /// Reads the file as the start of the daemon did, options of the command line included.
    std::function<config::LoadResult()> load;
    /// Looks at the files of the server's certificates.
    config::TlsCheck check_tls;
    /// Copy of what is served; it is written anew after a reload.
    std::filesystem::path last_good;
    /// Makes the machine follow, or only asks whether it could. Calls back once, as core::ReloadDone.
    std::function<void(core::Reload reload, bool dry_run, core::ReloadDone done)> apply;
    /// Told of what is served from now on, once the machine has followed. On the reloading thread.
    std::function<void(const config::Configuration& configuration)> adopted;
  };
  explicit ConfigurationService(Parts parts);
  /// As close().
  ~ConfigurationService() override;

  [[nodiscard]] std::shared_ptr<const ServedConfiguration> served() const override;
  void file_revision(std::function<void(Result<std::string>)> callback) override;
  void check(std::string yaml, std::function<void(Result<ConfigurationCheck>)> callback) override;
  void reload(std::string client, bool dry_run,
              std::function<void(Result<ConfigurationReload>)> callback) override;
  /// Copies what is served to `last_good`: it proved to be of use.
  void keep_copy() const;
  /// Ends the reload that is under way, which the machine has to answer, and takes no other.
  void close();

 private:
  struct Request {
    std::string client;
    bool dry_run = false;
    std::function<void(Result<ConfigurationReload>)> callback;
  };
  void run();
  ConfigurationReload serve(const Request& request);
  void adopt(config::Configuration configuration, const std::string& yaml);
  [[nodiscard]] std::set<std::string> named_files() const;

  Parts parts_;  ///< `configuration` is of the reloading thread
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::shared_ptr<const ServedConfiguration> served_;  // guarded by mutex_
  std::set<std::string> named_;                        // files, by what is served; guarded by mutex_
  std::optional<Request> request_;                     // guarded by mutex_
  bool busy_ = false;                                  // guarded by mutex_
  bool closing_ = false;                               // guarded by mutex_
  std::thread thread_;
  BoundedWorker looks_;
};

}  // namespace axisd
