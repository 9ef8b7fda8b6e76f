// A profile of what was seen on a user's own tool is a profile, and says no more than was seen.
#include "spindle/files/user_profile.hpp"

#include <doctest/doctest.h>

#include "spindle/files/profile_store.hpp"
#include "spindle/posix/disk.hpp"
#include "spindle/shipped/profiles.hpp"
#include "support/temporary_folder.hpp"

using namespace spindle;

namespace {

files::SeenOnTool seen() {
  return {
      .id = "mine", .extends = "doga-gen2", .seen = "serial 2401190042, firmware 4002, 2026-11-30"};
}

catalogue::LearnedAction known(std::string_view name) {
  const files::ProfileStore store({std::string(SPINDLE_SOURCE_DIR) + "/profiles"},
                                  posix::source_disk(), shipped::profiles());
  const auto profile = store.load("doga-gen2");
  REQUIRE(profile);
  for (const auto& action : profile->learn->actions) {
    if (action.name == name) return action;
  }
  FAIL("no such action");
  return {};
}

catalogue::Profile loaded(const std::string& text) {
  const test::TemporaryFolder folder;
  const std::string path = folder.write("mine.yaml", text);
  const files::ProfileStore store({std::string(SPINDLE_SOURCE_DIR) + "/profiles"},
                                  posix::source_disk(), shipped::profiles());
  const auto findings = store.check(path);
  REQUIRE(findings);
  for (const auto& finding : *findings) FAIL_CHECK(finding.to_string());
  const auto profile = store.load(path);
  REQUIRE(profile);
  return *profile;
}

}  // namespace

TEST_CASE("user profile: where the event block stands") {
  auto of_block = seen();
  of_block.event_block = 5300;
  of_block.remarks = {"Event 7 was read there."};
  const auto profile = loaded(files::render_user_profile(of_block));
  CHECK(profile.events->first == 5300);
  const auto number = profile.find("event.number");
  REQUIRE(number);
  CHECK(number->address.value == 5301);
  CHECK(number->evidence == catalogue::Evidence::sibling);  // of what stands where, nothing is new
}

TEST_CASE("user profile: an action that was learned") {
  for (const char* name : {"select-preset", "lock", "alarm-reset"}) {
    CAPTURE(name);
    auto of_action = seen();
    of_action.action = {known(name), 5010, 1};
    of_action.remarks = {"Register 5010 followed."};
    const auto profile = loaded(files::render_user_profile(of_action));
    const auto action = profile.find_action(name);
    REQUIRE(action);
    CHECK(action->address.value == 5010);
    CHECK(action->evidence == catalogue::Evidence::verified);
    CHECK(action->hazard != catalogue::Hazard::none);
    CHECK_FALSE(action->confirm.empty());
    CHECK(action->value.has_value() == (std::string_view(name) == "alarm-reset"));
    CHECK(profile.may_write(modbus::RegisterTable::holding, {5010}, 1));
    CHECK_FALSE(profile.may_write(modbus::RegisterTable::holding, {5011}, 1));
  }
}

TEST_CASE("user profile: a tool's own words end no comment and no text") {
  auto hostile = seen();
  hostile.seen = "serial \"\n}: [\x1b[2J\xff, firmware 4002";
  hostile.remarks = {"Register\n5010: followed # \x01 through " + std::string(300, 'x')};
  hostile.action = {known("lock"), 5010, 0};
  const std::string text = files::render_user_profile(hostile);
  CHECK(text.find('\x1b') == std::string::npos);
  CHECK(loaded(text).find_action("lock"));
}

TEST_CASE("user profile: no shipped profile says that it was seen on a tool") {
  const files::ProfileStore store({std::string(SPINDLE_SOURCE_DIR) + "/profiles"},
                                  posix::source_disk(), shipped::profiles());
  for (const auto& profile : store.load_all()) {
    CAPTURE(profile.id);
    for (const auto& parameter : profile.parameters) {
      CHECK(parameter.evidence != catalogue::Evidence::verified);
    }
    for (const auto& action : profile.actions) {
      CHECK(action.evidence != catalogue::Evidence::verified);
    }
  }
}
