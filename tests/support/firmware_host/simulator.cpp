// Run a sketch on a simulated board: the scenario comes on standard input, the bytes of the serial port go to standard output, and
// a report to standard error. A sketch that does what would harm a board or its bus ends the program with code 3.
//
// Scenario, a line each:
//   sensor KIND xshut PIN | sensor KIND channel ADDRESS CHANNEL      in the order of the sensors; KIND: vl53l0x and so on
//   reset PIN                                                        of the multiplexers
//   at MS reading SENSOR MM CODE | at MS off SENSOR | at MS on SENSOR | at MS stuck SENSOR | at MS free SENSOR
//   at MS lost 0                                                     the multiplexers lose their channels, as with their supply
//   light                                                            report when each sensor emits light
//   watch PIN                                                        report the rising edges that the sketch puts on a pin
//   edge US                                                          a rising edge on the pin that has an interrupt
//   run MS

#include "core/simulator.h"

#include <cstdio>
#include <cstdlib>
#include <deque>
#include <iostream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

void setup();
void loop();
extern const int* const board_taken;  // pins that must stay free, ended by -1

namespace {

struct Sensor {
  bool words = false;  // 16-bit numbers of registers
  uint16_t id = 0xEACC;
  int xshut = -1, multiplexer = -1, channel = -1;
  bool off = false, stuck = false;  // faults
  uint8_t address = 0x29;
  uint64_t awake_us = 0;  // when it boots
  bool shut = false, ranging = false, ready = false, single = false;
  uint64_t next_us = 0, lit_us = 0;  // when a reading is ready; when it began to emit
  uint32_t period_ms = 50;
  uint16_t mm = 0, at = 0;
  uint8_t code = 0;
  std::map<uint16_t, uint8_t> registers;
};

struct Event {
  uint64_t ms;
  std::string what;
  size_t sensor;
  unsigned mm, code;
};

struct Light {
  size_t sensor;
  uint64_t begin, end;
};

std::vector<Sensor> sensors;
std::vector<Light> lights;
std::vector<uint64_t> raised;  // edges of the watched pin
std::deque<uint64_t> edges;
void (*on_edge)() = nullptr;
int watched = -1;
bool report_light = false;
std::map<int, uint8_t> multiplexers;  // channels by address
std::deque<Event> events;
std::map<int, bool> output, level;
std::set<int> taken, used;
int reset_pin = -1, sda = -1, scl = -1;
uint64_t us = 0, busy_us = 0, sent_us = 0, longest_us = 0;
uint32_t hertz = 100000, timeout_ms = 50, baud = 0;

[[noreturn]] void fault(const std::string& text) {
  std::cerr << "fault: " << text << "\n";
  std::fflush(stdout);
  std::exit(3);
}

uint32_t number(Sensor& sensor, uint16_t at, uint32_t otherwise) {
  const uint32_t value = uint32_t(sensor.registers[at] << 8 | sensor.registers[uint16_t(at + 1)]);
  return value ? value : otherwise;
}

// Where the libraries here write the period and the time of a ranging, ms.
uint64_t period_us(Sensor& sensor) { return 1000ull * number(sensor, 0x62, sensor.period_ms); }
uint64_t ranging_us(Sensor& sensor) { return sensor.single || number(sensor, 0x62, 0) ? 1000ull * number(sensor, 0x60, 50) : period_us(sensor); }

void dark(Sensor& sensor) {
  if (sensor.ranging && us > sensor.lit_us) lights.push_back({size_t(&sensor - sensors.data()), sensor.lit_us, us});
  sensor.ranging = false;
}

// Note the rangings that have ended; unless it is a single one, the next begins after the period.
void shine(Sensor& sensor) {
  while (sensor.ranging && us >= sensor.lit_us + ranging_us(sensor)) {
    lights.push_back({size_t(&sensor - sensors.data()), sensor.lit_us, sensor.lit_us + ranging_us(sensor)});
    sensor.ranging = !sensor.single;
    sensor.lit_us += period_us(sensor);
  }
}

void boot(Sensor& sensor) {
  const uint64_t awake = us + 1200;
  dark(sensor);
  sensor.address = 0x29, sensor.ranging = sensor.ready = false, sensor.awake_us = awake;
  sensor.registers.clear();
}

bool there(const Sensor& sensor) {
  if (sensor.shut || sensor.off || us < sensor.awake_us) return false;
  if (sensor.multiplexer < 0) return true;
  return multiplexers.at(sensor.multiplexer) >> sensor.channel & 1;
}

void set_word(Sensor& sensor, uint16_t at, uint16_t value) {
  sensor.registers[at] = uint8_t(value >> 8);
  sensor.registers[uint16_t(at + 1)] = uint8_t(value);
}

// Registers of the sensors that the libraries here read, by their numbers in ST's drivers.
void measure(Sensor& sensor) {
  const bool done = sensor.ranging && !sensor.ready && us >= sensor.next_us;
  shine(sensor);
  if (!done) return;
  sensor.ready = true;
  if (sensor.words) {
    sensor.registers[0x89] = sensor.code;
    set_word(sensor, 0x96, sensor.mm);
  } else {
    sensor.registers[0x14] = uint8_t(sensor.code << 3);
    set_word(sensor, 0x1E, sensor.mm);
  }
}

void written(Sensor& sensor, uint16_t at, uint8_t value) {
  const bool page = !sensor.words && at != 0xFF && sensor.registers[0xFF];  // of a vl53l0x, with other registers
  if (page) return;
  sensor.registers[at] = value;
  const bool start = at == (sensor.words ? 0x87 : 0x00), clear = at == (sensor.words ? 0x86 : 0x0B);
  if (at == (sensor.words ? 0x01 : 0x8A)) sensor.address = value & 0x7F;
  if (sensor.words && at == 0x00 && value == 0) dark(sensor), sensor.ready = false;  // soft reset
  if (start) {
    dark(sensor);
    sensor.ready = false, sensor.single = value == (sensor.words ? 0x10 : 0x01);
    sensor.ranging = value != 0 && value != 0x80, sensor.lit_us = us, sensor.next_us = us + ranging_us(sensor);
  }
  if (clear && sensor.ready) {
    sensor.ready = false;
    while (sensor.next_us <= us) sensor.next_us += period_us(sensor);
  }
}

uint8_t value_of(Sensor& sensor, uint16_t at) {
  if (sensor.words) {
    if (at == 0x10F) return uint8_t(sensor.id >> 8);
    if (at == 0x110) return uint8_t(sensor.id);
    if (at == 0xE5) return 0x03;  // booted
    if (at == 0x30) return 0x11;
    if (at == 0x31) return sensor.ready ? 0 : 1;  // active low
  } else {
    if (at == 0xC0) return 0xEE;
    if (at == 0x13) return sensor.ready ? 0x44 : 0x40;
  }
  return sensor.registers[at];
}

void take_events() {
  while (!events.empty() && events.front().ms * 1000 <= us) {
    const Event event = events.front();
    events.pop_front();
    Sensor& sensor = sensors.at(event.sensor);
    if (event.what == "reading") sensor.mm = uint16_t(event.mm), sensor.code = uint8_t(event.code);
    if (event.what == "off") sensor.off = true;
    if (event.what == "on") sensor.off = false, boot(sensor);
    if (event.what == "lost")
      for (auto& one : multiplexers) one.second = 0;
    if (event.what == "stuck") sensor.stuck = true;
    if (event.what == "free") sensor.stuck = false;
  }
}

// Whether the bus works; the time of `bytes` bytes passes, or that of a timeout.
bool transfer(size_t bytes) {
  if (sda < 0) fault("the bus is used before it is begun");
  const uint64_t each = 9000000ull / hertz;
  bool held = false;
  for (const Sensor& sensor : sensors) held |= sensor.stuck && there(sensor);
  const uint64_t cost = held ? 1000ull * timeout_ms : each * (bytes + 1) + 2;
  busy_us += cost;
  simulator::pass_us(cost);
  return !held;
}

Sensor* answering(uint8_t address) {
  Sensor* one = nullptr;
  for (Sensor& sensor : sensors)
    if (there(sensor) && sensor.address == address) {
      if (one) fault("two sensors answer at one address");
      one = &sensor;
    }
  return one;
}

}  // namespace

namespace simulator {

void pin_mode(int pin, bool out) {
  if (taken.count(pin)) fault("pin " + std::to_string(pin) + " must stay free");
  if (pin == sda || pin == scl) fault("pin " + std::to_string(pin) + " belongs to the bus");
  used.insert(pin);
  output[pin] = out;
  pin_level(pin, level[pin]);
}

void pin_level(int pin, bool high) {
  if (!output.count(pin)) fault("pin " + std::to_string(pin) + " is written before its mode is set");
  const bool was = level[pin];
  level[pin] = high;
  const bool low = output[pin] && !high;
  if (pin == watched && high && !was) raised.push_back(us);
  if (pin == reset_pin && low)
    for (auto& one : multiplexers) one.second = 0;
  for (Sensor& sensor : sensors)
    if (sensor.xshut == pin && sensor.shut != low) {
      sensor.shut = low;
      if (low) dark(sensor);
      if (!low) boot(sensor);
    }
}

uint64_t now_us() { return us; }

void pass_us(uint64_t more) {
  const uint64_t until = us + more;
  while (!edges.empty() && edges.front() <= until) {
    us = us < edges.front() ? edges.front() : us;
    edges.pop_front();
    if (on_edge) on_edge();
  }
  us = until;
  take_events();
  for (Sensor& sensor : sensors) measure(sensor);
}

void interrupt(int pin, void (*called)()) {
  if (!used.count(pin)) fault("pin " + std::to_string(pin) + " has an interrupt before its mode is set");
  on_edge = called;
}

void open_serial(uint32_t rate) { baud = rate; }

size_t send(const uint8_t* data, size_t size) {
  if (!baud) fault("the serial port is used before it is begun");
  if (sent_us && us - sent_us > longest_us) longest_us = us - sent_us;
  sent_us = us;
  return std::fwrite(data, 1, size, stdout);
}

bool open_bus(int data, int clock, uint32_t rate) {
  for (int pin : {data, clock})
    if (taken.count(pin) || used.count(pin)) fault("pin " + std::to_string(pin) + " of the bus is taken");
  sda = data, scl = clock, hertz = rate;
  return true;
}

void bus_clock(uint32_t rate) { hertz = rate; }
void bus_timeout(uint32_t ms) { timeout_ms = ms; }

uint8_t write_bus(uint8_t address, const uint8_t* data, size_t size) {
  if (!transfer(size)) return 5;
  const auto multiplexer = multiplexers.find(address);
  if (multiplexer != multiplexers.end()) {
    for (size_t i = 0; i < size; i++) multiplexer->second = data[i];
    return 0;
  }
  Sensor* sensor = answering(address);
  if (!sensor) return 2;
  const size_t wide = sensor->words ? 2 : 1;
  if (size < wide) return 0;
  sensor->at = sensor->words ? uint16_t(data[0] << 8 | data[1]) : data[0];
  for (size_t i = wide; i < size; i++) written(*sensor, sensor->at++, data[i]);
  return 0;
}

size_t read_bus(uint8_t address, uint8_t* data, size_t size) {
  if (!transfer(size)) return 0;
  Sensor* sensor = answering(address);
  if (!sensor) return 0;
  for (size_t i = 0; i < size; i++) data[i] = value_of(*sensor, sensor->at++);
  return size;
}

}  // namespace simulator

int main() {
  std::string line, word;
  uint64_t run_ms = 0;
  while (std::getline(std::cin, line)) {
    std::istringstream text(line);
    text >> word;
    if (word == "sensor") {
      Sensor sensor;
      std::string kind, how;
      text >> kind >> how;
      sensor.words = kind != "vl53l0x";
      if (kind == "vl53l4cd") sensor.id = 0xEBAA;
      if (how == "xshut") text >> sensor.xshut;
      if (how == "channel") text >> sensor.multiplexer >> sensor.channel, multiplexers[sensor.multiplexer] = 0;
      sensors.push_back(sensor);
    } else if (word == "reset") {
      text >> reset_pin;
    } else if (word == "light") {
      report_light = true;
    } else if (word == "watch") {
      text >> watched;
    } else if (word == "edge") {
      uint64_t at = 0;
      text >> at;
      edges.push_back(at);
    } else if (word == "run") {
      text >> run_ms;
    } else if (word == "at") {
      Event event = {0, "", 0, 0, 0};
      text >> event.ms >> event.what >> event.sensor >> event.mm >> event.code;
      events.push_back(event);
    }
  }
  for (const int* pin = board_taken; *pin >= 0; pin++) taken.insert(*pin);
  take_events();
  setup();
  while (us < 1000 * run_ms) {
    loop();
    simulator::pass_us(20);
  }
  std::cerr << "bus " << sda << " " << scl << " " << hertz << " " << busy_us << " " << us << "\npins";
  for (int pin : used) std::cerr << " " << pin;
  std::cerr << "\nlongest_us " << longest_us << "\n";
  for (uint64_t at : raised) std::cerr << "edge " << at << "\n";
  if (report_light)
    for (const Light& light : lights) std::cerr << "light " << light.sensor << " " << light.begin << " " << light.end << "\n";
}
