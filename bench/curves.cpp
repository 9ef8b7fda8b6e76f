// Decodes a frame with two curves of 2000 samples many times: curves [COUNT]. Prints MB/s of the
// frame, from its bytes to numbers, and beside it those of memcpy.
#include <bit>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>
#include <variant>
#include <vector>

#include "spindle/catalogue/curve.hpp"
#include "spindle/modbus/adu.hpp"

namespace {

using namespace spindle;

constexpr std::uint16_t most = 2000;
constexpr std::uint16_t block_registers = 107;

catalogue::Parameter word(const char* name, std::uint16_t at) {
  catalogue::Parameter parameter;
  parameter.name = std::string(name);
  parameter.address = {at};
  return parameter;
}

catalogue::Profile product() {
  catalogue::Profile profile;
  catalogue::EventSpec events;
  events.function = 4;
  events.count = block_registers;
  events.number = std::string("number");
  events.kind = std::string("kind");
  events.fields = std::vector<catalogue::Parameter>{word("number", 1), word("kind", 12),
                                                    word("one", 72), word("two", 73)};
  events.frames = {{0x66, catalogue::FrameContent::event_with_curves}};
  catalogue::CurveSpec curves;
  curves.channels = {{std::string("one"), std::string("one")},
                     {std::string("two"), std::string("two")}};
  curves.most = most;
  events.curves = std::move(curves);
  profile.events = std::move(events);
  return profile;
}

Bytes frame() {
  Registers block(block_registers, 0);
  block[72] = block[73] = most;
  Bytes data;
  for (const std::uint16_t value : block) put_u16(data, value);
  for (unsigned sample = 0; sample < 2U * most; ++sample) {
    const auto pattern = std::bit_cast<std::uint32_t>(static_cast<float>(sample) / 1000.0F);
    put_u16(data, static_cast<std::uint16_t>(pattern >> 16U));
    put_u16(data, static_cast<std::uint16_t>(pattern & 0xFFFFU));
  }
  modbus::Pdu pdu = {.function = 0x66, .data = {}};
  put_u16(pdu.data, static_cast<std::uint16_t>(data.size()));
  pdu.data.insert(pdu.data.end(), data.begin(), data.end());
  return modbus::frame(modbus::Framing::tcp, {{0}, {0}, std::move(pdu)});
}

template <typename Once>
double rate(std::size_t bytes, int count, const Once& once) {
  const auto begin = std::chrono::steady_clock::now();
  for (int done = 0; done < count; ++done) once();
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
  return static_cast<double>(bytes) * count / taken.count() / 1e6;
}

}  // namespace

int main(int count_of_arguments, char** arguments) {
  const int count = count_of_arguments > 1 ? std::atoi(arguments[1]) : 20'000;
  const catalogue::Profile profile = product();
  const catalogue::EventFrames frames(profile);
  const Bytes bytes = frame();
  volatile float last = 0;
  const double decoded = rate(bytes.size(), count, [&] {
    const auto found = modbus::deframe(modbus::Framing::tcp, modbus::Role::client, bytes);
    const auto pushed = frames.decode(std::get<modbus::Deframed>(found).adu.pdu);
    for (const auto& channel : pushed->channels) {
      last = catalogue::to_samples(channel.samples).back();
    }
  });
  Bytes copy(bytes.size());
  const double copied = rate(bytes.size(), count, [&] {
    std::memcpy(copy.data(), bytes.data(), bytes.size());
    last = static_cast<float>(copy[bytes.size() - 1]);
  });
  std::printf("%.0f MB/s decoded, %.0f MB/s copied: %.3f\n", decoded, copied, decoded / copied);
  return 0;
}
