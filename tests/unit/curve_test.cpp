#include "spindle/catalogue/curve.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "hex.hpp"
#include "spindle/device/curve_collector.hpp"
#include "spindle/link/demux.hpp"
#include "spindle/modbus/adu.hpp"
#include "support/rig.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using catalogue::EventFrames;
using modbus::Framing;
using modbus::Role;
using test::hex;

namespace {

const catalogue::Profile& gen2() {
  static const test::Product product = test::product("doga-gen2");
  return product.profile;
}

/// The frames of the facts, by their names.
std::map<std::string, Bytes> frames_of_facts() {
  std::map<std::string, Bytes> frames;
  std::ifstream file(SPINDLE_SOURCE_DIR "/tests/peer/gen2_frames.txt");
  std::string name;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line.front() == '#') continue;
    const auto tab = line.find('\t');
    if (tab != std::string::npos) {
      name = line.substr(tab + 1);
    } else {
      line.erase(std::remove(line.begin(), line.end(), ' '), line.end());
      frames.emplace(name, hex(line));
    }
  }
  return frames;
}

Bytes frame_named(std::string_view part) {
  for (const auto& [name, bytes] : frames_of_facts()) {
    if (name.find(part) != std::string::npos) return bytes;
  }
  FAIL("no frame of the facts is called " << part);
  return {};
}

modbus::Pdu pdu_of(const Bytes& frame) {
  const auto found = modbus::deframe(Framing::tcp, Role::client, frame);
  const auto* whole = std::get_if<modbus::Deframed>(&found);
  REQUIRE(whole != nullptr);
  REQUIRE(whole->consumed == frame.size());
  return whole->adu.pdu;
}

Bytes joined(const std::vector<Bytes>& parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// A frame of this function whose data begin with their own length, or with a lie.
Bytes long_frame(std::uint8_t function, const Bytes& data, int lie = 0) {
  Bytes frame;
  put_u16(frame, 0);
  put_u16(frame, 0);
  put_u16(frame, static_cast<std::uint16_t>(4 + data.size()));
  frame.push_back(0);
  frame.push_back(function);
  put_u16(frame, static_cast<std::uint16_t>(static_cast<int>(data.size()) + lie));
  frame.insert(frame.end(), data.begin(), data.end());
  return frame;
}

Bytes curve_data(std::uint16_t channel, std::uint16_t says, const std::vector<float>& samples) {
  Bytes data;
  put_u16(data, channel);
  put_u16(data, says);
  for (const float sample : samples) {
    const auto pattern = std::bit_cast<std::uint32_t>(sample);
    put_u16(data, static_cast<std::uint16_t>(pattern >> 16U));
    put_u16(data, static_cast<std::uint16_t>(pattern & 0xFFFFU));
  }
  return data;
}

std::vector<float> first_curve() { return {0.0F, 0.5F, 1.5F, 2.0625F}; }
std::vector<float> second_curve() { return {0.0F, 360.0F, 1058.0F, 1457.0F}; }

/// Whether the frames that come out of a stream are those that went in.
bool comes_out(const Bytes& stream, const std::vector<Bytes>& frames, std::size_t piece) {
  Bytes buffer;
  std::size_t next = 0;
  for (std::size_t at = 0; at < stream.size(); at += piece) {
    const std::size_t size = std::min(piece, stream.size() - at);
    buffer.insert(buffer.end(), stream.begin() + static_cast<std::ptrdiff_t>(at),
                  stream.begin() + static_cast<std::ptrdiff_t>(at + size));
    while (true) {
      const auto found = modbus::deframe(Framing::tcp, Role::client, buffer);
      if (std::holds_alternative<modbus::Junk>(found)) return false;
      const auto* whole = std::get_if<modbus::Deframed>(&found);
      if (whole == nullptr) break;
      if (next == frames.size()) return false;
      const Bytes& wanted = frames[next++];
      if (whole->consumed != wanted.size()) return false;
      if (!std::equal(wanted.begin(), wanted.end(), buffer.begin())) return false;
      buffer.erase(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(whole->consumed));
    }
  }
  return next == frames.size() && buffer.empty();
}

}  // namespace

TEST_CASE("curve: an event says the same whichever of its forms brings it") {
  const EventFrames frames(gen2());
  const catalogue::EventLayout layout(gen2());
  const Bytes both = frame_named("event with both curves");
  std::vector<Registers> blocks;
  for (const char* name : {"pushed event as FC 04", "same event as FC 65"}) {
    const auto decoded = frames.decode(pdu_of(frame_named(name)));
    REQUIRE(decoded.has_value());
    REQUIRE(decoded->block.has_value());
    CHECK(decoded->channels.empty());
    blocks.push_back(*decoded->block);
  }
  const auto whole = frames.decode(pdu_of(both));
  REQUIRE(whole.has_value());
  blocks.push_back(*whole->block);
  for (const Registers& block : blocks) {
    CHECK(block.size() == 107);
    CHECK(layout.number_of(block) == 1962);
    CHECK(layout.kind_of(block) == catalogue::EventKind::fastening_ok);
    CHECK(layout.torque_unit_of(block, "lbf.in") == "N.m");
    CHECK(layout.key_of(block) == layout.key_of(blocks.front()));
  }
  Registers of_unknown_unit = blocks.front();
  of_unknown_unit[layout.find("event.torque-unit")->at] = 9;
  CHECK(layout.torque_unit_of(of_unknown_unit, "lbf.in").empty());
  REQUIRE(whole->channels.size() == 2);
  CHECK(catalogue::to_samples(whole->channels[0].samples) == first_curve());
  CHECK(catalogue::to_samples(whole->channels[1].samples) == second_curve());
  const auto facts = catalogue::curve_facts(gen2(), layout, blocks.back(), "");
  REQUIRE(facts.channels.size() == 2);
  CHECK(facts.channels[0].is == catalogue::CurveQuantity::torque);
  CHECK(facts.channels[0].unit == "N.m");
  CHECK(facts.channels[1].is == catalogue::CurveQuantity::angle);
  CHECK(facts.sampling_ms == 5);
  REQUIRE(facts.steps.size() == 3);
  CHECK(facts.steps[1].name == "fastening");
  CHECK(facts.steps[2].sample == 3);
}

TEST_CASE("curve: a channel comes with its samples, and one that no product has does not") {
  const EventFrames frames(gen2());
  const auto first = frames.decode(pdu_of(frame_named("curve channel 1")));
  REQUIRE(first.has_value());
  CHECK(!first->block.has_value());
  REQUIRE(first->channels.size() == 1);
  CHECK(first->channels[0].channel == 0);
  CHECK(catalogue::to_samples(first->channels[0].samples) == first_curve());
  for (const std::uint16_t channel : std::vector<std::uint16_t>{0, 3, 0xFFFF}) {
    CHECK(!frames.decode(pdu_of(long_frame(0x64, curve_data(channel, 4, first_curve())))));
  }
}

TEST_CASE("curve: every frame of the facts, cut at every byte and glued, is itself or nothing") {
  std::vector<Bytes> all;
  for (const auto& [name, bytes] : frames_of_facts()) {
    const bool is_tcp = bytes.size() >= 8 && bytes[2] == 0 && bytes[3] == 0 &&
                        get_u16(bytes, 4) + 6U == bytes.size();
    if (is_tcp) all.push_back(bytes);
  }
  REQUIRE(all.size() >= 20);
  for (const Bytes& frame : all) {
    for (std::size_t cut = 0; cut < frame.size(); ++cut) {
      const auto part = modbus::deframe(Framing::tcp, Role::client, ByteView(frame).first(cut));
      CHECK(std::holds_alternative<modbus::NeedMore>(part));
    }
  }
  const Bytes glued = joined(all);
  for (const std::size_t piece : {1U, 2U, 7U, 13U, 100U, 1460U, 100'000U}) {
    CHECK(comes_out(glued, all, piece));
  }
}

TEST_CASE("curve: two curves of 2000 samples come through in pieces") {
  const Bytes block = [] {
    const auto frames = EventFrames(gen2());
    Registers registers = *frames.decode(pdu_of(frame_named("same event as FC 65")))->block;
    registers[72] = registers[73] = 2000;
    Bytes bytes;
    for (const std::uint16_t word : registers) put_u16(bytes, word);
    return bytes;
  }();
  const Bytes samples = curve_data(0, 0, std::vector<float>(4000, 1.5F));
  const Bytes frame = long_frame(0x66, joined({block, Bytes(samples.begin() + 4, samples.end())}));
  const Bytes answer = frame_named("its answer: 1.25, 300 rpm");
  CHECK(comes_out(joined({answer, frame, answer, frame}), {answer, frame, answer, frame}, 1460));
  const auto decoded = EventFrames(gen2()).decode(pdu_of(frame));
  REQUIRE(decoded.has_value());
  CHECK(catalogue::to_samples(decoded->channels[1].samples) == std::vector<float>(2000, 1.5F));
}

TEST_CASE("curve: lengths that lie never become a value") {
  const EventFrames frames(gen2());
  // In front of the data, against the header: a short one is a stray, a long one breaks the stream.
  for (const int lie : {-4, -1, 1, 4, 1000}) {
    const modbus::Pdu pdu = pdu_of(long_frame(0x64, curve_data(1, 4, first_curve()), lie));
    CHECK(!frames.decode(pdu));
    CHECK(link::has_shape(pdu, {.function = 0x64}));  // for those who can say what was lost
    const Bytes large = long_frame(0x64, curve_data(1, 500, std::vector<float>(500, 1.0F)), lie);
    CHECK(std::holds_alternative<modbus::Junk>(modbus::deframe(Framing::tcp, Role::client, large)));
  }
  // Counts against the data.
  for (const std::uint16_t says : std::vector<std::uint16_t>{0, 3, 5, 2001, 65'535}) {
    CHECK(!frames.decode(pdu_of(long_frame(0x64, curve_data(1, says, first_curve())))));
  }
  CHECK(!frames.decode(
      pdu_of(long_frame(0x64, curve_data(1, 2001, std::vector<float>(2001, 0.0F))))));
  Bytes both = frame_named("event with both curves");
  for (const std::size_t count_at : {10U + 144U, 10U + 146U}) {
    Bytes wrong = both;
    wrong[count_at + 1] = 5;
    CHECK(!frames.decode(pdu_of(wrong)));
    wrong[count_at] = 0xFF;
    CHECK(!frames.decode(pdu_of(wrong)));
  }
  // A header that promises what no frame has.
  Bytes endless = long_frame(0x64, {});
  endless[4] = endless[5] = 0xFF;
  CHECK(std::holds_alternative<modbus::Junk>(modbus::deframe(Framing::tcp, Role::client, endless)));
}

TEST_CASE("curve: a server takes no long frames, and a function of the standard is never long") {
  const Bytes large = long_frame(0x64, curve_data(1, 500, std::vector<float>(500, 1.0F)));
  CHECK(std::holds_alternative<modbus::Junk>(modbus::deframe(Framing::tcp, Role::server, large)));
  for (const std::uint8_t function : Bytes{0x03, 0x04, 0x10, 0x11, 0x63, 0x6F, 0xE4}) {
    CHECK(std::holds_alternative<modbus::Junk>(
        modbus::deframe(Framing::tcp, Role::client, long_frame(function, Bytes(1000, 0)))));
  }
}

TEST_CASE("curve: what has no date or an impossible one says so") {
  const catalogue::EventLayout layout(gen2());
  const EventFrames frames(gen2());
  Registers block = *frames.decode(pdu_of(frame_named("same event as FC 65")))->block;
  const auto* field = layout.find("event.tool-time");
  REQUIRE(field != nullptr);
  const auto date = [&] {
    return catalogue::decode(*field->parameter, RegisterView(block).subspan(field->at, 4));
  };
  CHECK(date()->text == "2026-05-28 14:30:45");
  block[3] = static_cast<std::uint16_t>(13 << 8) | 28;
  CHECK(!date().has_value());
  std::fill_n(block.begin() + 2, 3, std::uint16_t{0});
  block[5] = 0x0007;  // the fraction alone
  CHECK(date()->content == catalogue::Content::none);
}

namespace {

/// What a collector tells, of two events of one channel each.
struct Collected {
  EventFrames frames = EventFrames(gen2());
  catalogue::EventLayout layout = catalogue::EventLayout(gen2());
  std::vector<device::ToolCurve> told = {};
  device::CurveCollector collector = device::CurveCollector(
      frames, [this](const device::ToolCurve& curve) { told.push_back(curve); });
  TimePoint now = TimePoint(100s);

  Registers block(std::uint16_t number) const {
    Registers registers = *frames.decode(pdu_of(frame_named("same event as FC 65")))->block;
    registers[1] = number;
    return registers;
  }
  void event(std::uint16_t number) {
    const Registers own = block(number);
    collector.close_before(layout.key_of(own));
    collector.take_event(number, layout.key_of(own), own, {}, now, {});
  }
  void part(std::size_t channel, std::size_t samples = 4) {
    collector.take_part({.channel = channel, .samples = Bytes(4 * samples, 1)}, now, {});
  }
};

}  // namespace

TEST_CASE("curve: parts behind their event and in front of it are brought together") {
  for (const bool parts_lead : {false, true}) {
    Collected collected;
    if (!parts_lead) collected.event(7);
    collected.part(0);
    CHECK(collected.told.empty());
    collected.part(1);
    if (parts_lead) collected.event(7);
    REQUIRE(collected.told.size() == 1);
    CHECK(collected.told[0].number == 7);
    CHECK(collected.told[0].is_whole);
    collected.event(7);  // another form of it
    CHECK(collected.told.size() == 1);
  }
}

TEST_CASE("curve: parts that fit no event are told as such, and none is kept for ever") {
  Collected collected;
  collected.event(7);
  collected.part(0, 3);  // another count
  collected.now += 3s;
  collected.collector.run_due(collected.now);
  REQUIRE(collected.told.size() == 1);
  CHECK(!collected.told[0].block.has_value());
  CHECK(collected.collector.next_due() == TimePoint::max());
  for (int flood = 0; flood < 1000; ++flood) collected.part(0, 3);
  CHECK(collected.told.size() == 1000);
}

TEST_CASE("curve: a part that is missing does not hold back the others") {
  Collected collected;
  collected.event(7);
  collected.part(1);
  collected.event(8);
  REQUIRE(collected.told.size() == 1);
  CHECK(collected.told[0].number == 7);
  CHECK(!collected.told[0].is_whole);
  CHECK(collected.told[0].channels[0].empty());
}
