// Collects findings, so that one run shows them all.
#pragma once

#include <string>
#include <vector>

#include "config/configuration.hpp"
#include "config/document.hpp"

namespace axisd::config {

class Diagnostics {
 public:
  explicit Diagnostics(std::string file) : file_(std::move(file)) {}
  void add(Mark mark, std::string message, std::string suggestion = {});
  [[nodiscard]] const std::string& file() const { return file_; }
  [[nodiscard]] bool empty() const { return found_.empty(); }
  /// In the order of the file, each once: a value that several axes use through an alias is wrong once.
  [[nodiscard]] std::vector<Diagnostic> sorted() const;

 private:
  std::string file_;
  std::vector<Diagnostic> found_;
};

}  // namespace axisd::config
