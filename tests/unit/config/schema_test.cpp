// Walks the schema: every key is documented, has an effect, and its default is the one that the structs have.
#include "config/schema.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "config/document.hpp"
#include "config/fields.hpp"
#include "config/reader.hpp"
#include "config/value.hpp"
#include "devices/descriptor.hpp"
#include "tests/unit/config/dump.hpp"
#include "tests/unit/config/support.hpp"

namespace axisd::config {
namespace {

/// A document as text again, with some values replaced and some keys left out, by path.
class Emitter {
 public:
  Emitter& replace(const std::string& path, std::string_view text) {
    replaced_[path] = text;
    return *this;
  }
  Emitter& erase(const std::string& path) {
    erased_.insert(path);
    return *this;
  }
  Emitter& put_back(const std::string& path) {
    erased_.erase(path);
    return *this;
  }
  [[nodiscard]] std::string text(const Node& node, const std::string& path = "") const {
    if (const auto found = replaced_.find(path); found != replaced_.end()) return found->second;
    switch (node.kind) {
      case Node::Kind::null:
        return "~";
      case Node::Kind::scalar:
        return node.plain ? node.text : fmt::format("'{}'", node.text);
      case Node::Kind::list:
        return list(node, path);
      case Node::Kind::section:
        return section(node, path);
    }
    return "";
  }

 private:
  [[nodiscard]] std::string list(const Node& node, const std::string& path) const {
    std::string result;
    for (const auto& item : node.items) result += (result.empty() ? "" : ", ") + text(*item, path + "[]");
    return "[" + result + "]";
  }
  [[nodiscard]] std::string section(const Node& node, const std::string& path) const {
    std::string result;
    for (const auto& [key, value] : node.entries) {
      const auto here = path.empty() ? key->text : path + "." + key->text;
      if (erased_.contains(here)) continue;
      result += fmt::format("{}{}: {}", result.empty() ? "" : ",\n", key->text, text(*value, here));
    }
    return "{ " + result + " }";
  }
  std::map<std::string, std::string> replaced_;
  std::set<std::string> erased_;
};

/// The reference with its first axis of another model, on a bus of the model's kind.
Emitter with_model(const DriveDescriptor& model) {
  Emitter emitter;
  emitter.replace("axes.feeder.model", model.model);
  if (model.bus == BusKind::canopen) emitter.replace("axes.feeder.bus", "can0");
  if (model.capabilities.maximum_start_rpm == 0) emitter.erase("axes.feeder.limits.start_speed");
  if (model.specialise == nullptr) {
    emitter.erase("axes.spindle");  // its file takes longer to read than all the rest
  } else {
    for (const std::string key : {"inputs", "outputs", "homing", "drift_check"})
      emitter.erase("axes.feeder." + key);
  }
  return emitter;
}

/// What no axis of the model can do without; the example is the reference's.
std::string required_settings(const DriveDescriptor& model) {
  std::string text;
  for (const auto& setting : model.settings)
    if (setting.required) text += fmt::format("{}: {}, ", setting.key, setting_schema(setting).example);
  if (model.specialise != nullptr) text += "velocity_unit: pulses_per_second, ";  // the file does not tell
  return text;
}

/// The only function that a terminal may have, if it has one.
bool is_other_function(const TerminalSpec& terminal, std::string_view function, std::string_view level) {
  return !terminal.function.empty() && (terminal.function != function || level != "high");
}

struct Leaf {
  std::string path;  ///< with * for names and numbers
  const KeySpec* spec;
};

void collect(std::span<const KeySpec> keys, const std::string& path, std::vector<Leaf>& leaves) {
  for (const auto& spec : keys) {
    const auto here = path.empty() ? std::string(spec.key) : fmt::format("{}.{}", path, spec.key);
    if (spec.kind == Kind::section) collect(spec.children, here, leaves);
    if (spec.kind == Kind::named_sections || spec.kind == Kind::numbered_sections)
      collect(spec.children, here + ".*", leaves);
    if (spec.children.empty()) leaves.push_back({here, &spec});
  }
}

std::vector<Leaf> leaves() {
  std::vector<Leaf> result;
  collect(schema(), "", result);
  return result;
}

const Node* find(const Node& root, std::string_view path) {
  const Node* node = &root;
  while (node != nullptr && !path.empty()) {
    const auto dot = std::min(path.find('.'), path.size());
    node = node->find(path.substr(0, dot));
    path.remove_prefix(std::min(dot + 1, path.size()));
  }
  return node;
}

class Schema : public ::testing::Test {
 protected:
  Schema() : root_(*parse_document(read_text(source_path("config/examples/reference.yaml")))) {}

  /// The first path in the reference that the pattern stands for; empty if it lacks the key.
  [[nodiscard]] std::string in_reference(const std::string& pattern) const {
    const auto star = pattern.find('*');
    if (star == std::string::npos) return find(*root_, pattern) == nullptr ? "" : pattern;
    const auto* sections = find(*root_, pattern.substr(0, star - 1));
    if (sections == nullptr) return "";
    for (const auto& [name, section] : sections->entries) {
      const auto path = in_reference(pattern.substr(0, star) + name->text + pattern.substr(star + 1));
      if (!path.empty()) return path;
    }
    return "";
  }
  [[nodiscard]] Configuration configuration(const Emitter& emitter) const {
    // There, so that paths in it are found.
    const auto result = load_text(emitter.text(*root_), source_path("config/examples/changed.yaml").string());
    EXPECT_TRUE(result.configuration) << findings(result) << emitter.text(*root_);
    return result.configuration.value_or(Configuration{});
  }
  [[nodiscard]] std::string loaded(const Emitter& emitter) const { return dump(configuration(emitter)); }

  NodePtr root_;
};

TEST_F(Schema, IsDocumented) {
  for (const auto& [path, spec] : leaves()) {
    EXPECT_FALSE(spec->description.empty()) << path;
    const bool of_model = spec->kind == Kind::terminals || spec->kind == Kind::model_settings;
    EXPECT_EQ(spec->example.empty(), of_model) << path;
    const bool only_choice = spec->kind == Kind::choice && spec->choices.size() == 1;
    EXPECT_EQ(spec->field.apply == nullptr, of_model || only_choice) << path;
    if (spec->kind == Kind::text) EXPECT_FALSE(spec->pattern.empty() || spec->pattern_hint.empty()) << path;
    if (spec->required) EXPECT_TRUE(spec->default_value.empty()) << path;
  }
}

TEST_F(Schema, ReferenceShowsEveryKey) {
  for (const auto& [path, spec] : leaves()) EXPECT_NE(in_reference(path), "") << path;
}

TEST_F(Schema, ReferenceShowsEverySettingOfEveryModel) {
  std::map<std::string, const Node*, std::less<>> drives;
  for (const auto& [name, axis] : find(*root_, "axes")->entries) {
    if (const auto* drive = axis->find("drive")) drives.emplace(axis->find("model")->text, drive);
  }
  for (const auto* model : drive_models()) {
    const auto drive = drives.find(model->model);
    ASSERT_NE(drive, drives.end()) << model->model;
    for (const auto& setting : model->settings)
      EXPECT_NE(drive->second->find(setting.key), nullptr) << model->model << ": " << setting.key;
  }
}

TEST_F(Schema, EveryKeyHasAnEffect) {
  const auto before = configuration(Emitter());
  for (const auto& [pattern, spec] : leaves()) {
    if (spec->example.empty()) continue;  // of the model: below
    const auto path = in_reference(pattern);
    if (spec->key == "model") {
      const auto refused = load_text(Emitter().replace(path, "none").text(*root_), "changed.yaml");
      EXPECT_FALSE(refused.configuration) << path;
    } else if (pattern == "axes.*.unit") {
      auto text = Emitter().text(*root_);
      for (auto at = text.find("mm"); at != std::string::npos; at = text.find("mm", at))
        text.replace(at, 2, "cm");
      const auto result = load_text(text, source_path("config/examples/changed.yaml").string());
      ASSERT_TRUE(result.configuration) << findings(result);
      EXPECT_FALSE(differences(before, *result.configuration).empty()) << path;
    } else {
      // Of that key only, by the name that it has in the file.
      const auto changes = differences(before, configuration(Emitter().replace(path, spec->example)));
      ASSERT_EQ(changes.size(), 1U) << path << ": " << spec->example;
      EXPECT_EQ(changes[0].kind, ConfigurationChangeKind::changed) << path;
      if (changes[0].keys.empty())
        EXPECT_EQ(changes[0].path(), path);
      else
        EXPECT_THAT(changes[0].keys, testing::ElementsAre(path.substr(changes[0].path().size() + 1)));
    }
  }
}

TEST_F(Schema, DefaultsAreThoseOfTheStructs) {
  int checked = 0;
  for (const auto& [pattern, spec] : leaves()) {
    if (spec->default_value.empty()) continue;
    const auto path = in_reference(pattern);
    auto written = Emitter().replace(path, spec->default_value), left_out = Emitter().erase(path);
    if (spec->key == "listen") {  // the default is for loopback, the reference is not: both are fine with tls
      for (const auto* key : {"server.tls", "server.stop_listen"}) {
        written.erase(key);
        left_out.erase(key);
      }
    }
    EXPECT_EQ(loaded(written), loaded(left_out)) << path << ": " << spec->default_value;
    ++checked;
  }
  EXPECT_GT(checked, 20);
}

TEST_F(Schema, MisspeltKeysAreSuggested) {
  for (const auto& [pattern, spec] : leaves()) {
    const auto path = in_reference(pattern);
    const std::string key(spec->key);
    auto text = Emitter().replace(path, "@@").text(*root_);
    const auto at = text.find(key + ": @@");
    ASSERT_NE(at, std::string::npos) << path;
    text.replace(at, key.size() + 4, key + "x: 1");
    const auto result = load_text(text, source_path("config/examples/changed.yaml").string());
    EXPECT_NE(findings(result).find(fmt::format("unknown key '{0}x'", key)), std::string::npos)
        << findings(result);
    EXPECT_NE(findings(result).find(fmt::format("did you mean '{}'?", key)), std::string::npos)
        << findings(result);
  }
}

TEST_F(Schema, EverySettingOfEveryModelHasAnEffect) {
  for (const auto* model : drive_models()) {
    const auto of_model = [&] { return with_model(*model); };
    const auto required = required_settings(*model);
    for (const auto& setting : model->settings) {
      // The drive's tests show what the file does; those of objects are in eds_test.cpp.
      if (setting.kind == "path" || setting.kind == "objects") continue;
      if (setting.key == "velocity_unit") continue;  // its values permit different velocities
      std::vector<std::string> values(setting.choices.begin(), setting.choices.end());
      if (setting.kind == "boolean") values = {"true", "false"};
      if (setting.kind == "integer")
        values = {std::to_string(setting.minimum), std::to_string(setting.maximum)};
      std::set<std::string> dumps;
      for (const auto& value : values) {
        const auto drive = fmt::format("{{ {}{}: {} }}", required, setting.key, value);
        dumps.insert(loaded(of_model().replace("axes.feeder.drive", drive)));
      }
      EXPECT_EQ(dumps.size(), values.size()) << setting.key;
      EXPECT_GE(values.size(), 2U) << setting.key;
      if (!setting.default_value.empty()) {
        const auto drive = fmt::format("{{ {}{}: {} }}", required, setting.key, setting.default_value);
        EXPECT_EQ(loaded(of_model().replace("axes.feeder.drive", drive)),
                  loaded(of_model().replace("axes.feeder.drive", fmt::format("{{ {} }}", required))))
            << setting.key;
      }
    }
  }
}

TEST_F(Schema, EveryTerminalTakesEveryFunction) {
  for (const auto* model : drive_models()) {
    std::set<std::string> dumps;
    std::size_t expected = 0;
    const auto drive = fmt::format("{{ {} }}", required_settings(*model));
    const auto try_all = [&](std::string_view section, const auto& terminals, const auto& functions) {
      const auto section_path = fmt::format("axes.feeder.{}", section);
      for (const auto& terminal : terminals) {
        for (const auto& function : functions) {
          if (!function.unusable.empty()) continue;
          for (const auto level : {"low", "high"}) {
            if (is_other_function(terminal, function.name, level)) continue;
            const auto text =
                fmt::format("{{ {}: {{ function: {}, active: {} }} }}", terminal.name, function.name, level);
            auto changed = with_model(*model).erase("axes.feeder.homing").replace("axes.feeder.drive", drive);
            dumps.insert(loaded(changed.put_back(section_path).replace(section_path, text)));
            ++expected;
          }
        }
      }
    };
    try_all("inputs", model->inputs, model->input_functions);
    try_all("outputs", model->outputs, model->output_functions);
    EXPECT_EQ(dumps.size(), expected) << model->model;
  }
}

}  // namespace
}  // namespace axisd::config
