// Flight records in memory, in virtual time.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "buses/task.hpp"
#include "daemon/store/record_files.hpp"

namespace axisd::test {

class FakeRecordFiles final : public store::RecordFiles {
 public:
  explicit FakeRecordFiles(Executor core) : core_(std::move(core)) {}

  std::map<std::string, std::string> texts;  ///< by name

  void write(std::string name, Render render, std::function<void(Result<void>)> done) override {
    texts[name] = render();
    post(core_, [done = std::move(done)] { done({}); });
  }
  void list(std::function<void(Result<std::vector<FlightRecord>>)> done) override {
    std::vector<FlightRecord> records;
    for (const auto& [name, text] : texts) {
      FlightRecord record{.name = name, .size = text.size()};
      store::describe(text, record);
      records.push_back(std::move(record));
    }
    post(core_, [done = std::move(done), records] { done(records); });
  }
  void read(std::string name, std::function<void(Result<std::string>)> done) override {
    post(core_, [done = std::move(done), text = texts[name]] { done(text); });
  }

 private:
  Executor core_;
};

}  // namespace axisd::test
