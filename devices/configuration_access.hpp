// The configuration that a machine is served from, as the API shows it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "devices/configuration_change.hpp"

namespace axisd {

/// What was read when the daemon started, or at the last reload, whatever the file holds by now.
struct ServedConfiguration {
  std::string yaml;
  std::string path;      ///< as the daemon was given it
  std::string revision;  ///< of the text: equal texts have equal ones
  WallTime served_since{};
};

struct ConfigurationFinding {
  std::uint32_t line = 0, column = 0;  ///< 1-based; 0: of the file as a whole
  std::string message;                 ///< with the offending text
  std::string suggestion;              ///< empty if there is none
};

struct ConfigurationCheck {
  std::vector<ConfigurationFinding> findings;  ///< in the order of the file; none: it could be served
  std::vector<std::string> warnings;           ///< what its buses do not meet, where they only warn
  std::string revision;
};

/// What became of a reload, or would.
struct ConfigurationReload {
  bool applied = false;                        ///< the file is served now; all of it, or else nothing
  std::vector<ConfigurationFinding> findings;  ///< of a file that cannot be served; then nothing else
  std::vector<std::string> warnings;           ///< as in ConfigurationCheck
  std::vector<ConfigurationChange> changes;    ///< from what was served before
  std::vector<Error> refusals;                 ///< what stands against it, all, each with what to do
  std::string before, revision;                ///< of the texts
};

/// Thread: any.
class ConfigurationAccess {
 public:
  virtual ~ConfigurationAccess() = default;
  [[nodiscard]] virtual std::shared_ptr<const ServedConfiguration> served() const = 0;
  /// The revision of what the file holds now, empty if it cannot be read. Calls back once, from a thread of
  /// its own or, with busy (too many ask), at once; not at all if the daemon ends before.
  virtual void file_revision(std::function<void(Result<std::string>)> callback) = 0;
  /// Checks a text as a start of the daemon would, with relative paths in it counting from the served file.
  /// Takes milliseconds, some seconds at most. Opens no port. Calls back as file_revision().
  virtual void check(std::string yaml, std::function<void(Result<ConfigurationCheck>)> callback) = 0;
  /// Reads the file again, and makes it what is served, all of it or nothing; `dry_run`: only tells what
  /// would become of it. Calls back once, from a thread of its own, at once or when axes that change have
  /// been exchanged. Errors: busy (another reload is under way), cancelled (the daemon ends).
  virtual void reload(std::string client, bool dry_run,
                      std::function<void(Result<ConfigurationReload>)> callback) = 0;
};

}  // namespace axisd
