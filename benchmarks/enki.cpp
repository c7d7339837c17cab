// How fast stock Enki runs e-pucks, on request: the scenario of simulation.py, in Enki's centimetres.
//
// It only calls Enki (GPL-2; Debian's libenki-dev). A line on stdin, "drive compiled ROBOTS 0 1", is answered with CPU
// seconds, wall seconds, robot-steps and 0; any other request with "- " and the reason.
//
// Stock Enki also simulates the scanner turret of every e-puck, wanted or not: its flag shares bits with the others.
// With the argument --sensors-only the robots have their eight infrared sensors and nothing else, as those of elib.

#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <iostream>
#include <map>
#include <memory>
#include <random>
#include <string>

#include <enki/PhysicalEngine.h>
#include <enki/robots/e-puck/EPuck.h>

const double STEP = 1.0 / 32;
const double CM_PER_MOTOR_STEP = 0.01288;
const double LEFT[] = {-0.9, -0.6, -0.1, 0.0, 0.0, 0.1, 0.3, 0.4};  // Steps/s a count, as Controller.braitenberg().
const double RIGHT[] = {0.4, 0.3, 0.1, 0.0, 0.0, -0.1, -0.6, -0.7};
const int ROBOT_STEPS = 20000;  // In one answer.
const int MOST_ROBOTS = 1000;   // Its time a tick grows with the square.

struct Vehicle : Enki::EPuck {
    explicit Vehicle(bool has_turret) : EPuck(has_turret ? CAPABILITY_BASIC_SENSORS : CAPABILITY_NONE) {
        if (has_turret) return;
        for (auto* sensor : {&infraredSensor0, &infraredSensor1, &infraredSensor2, &infraredSensor3, &infraredSensor4,
                             &infraredSensor5, &infraredSensor6, &infraredSensor7})
            addLocalInteraction(sensor);
    }

    void controlStep(double step) override {
        const Enki::IRSensor* sensors[] = {&infraredSensor0, &infraredSensor1, &infraredSensor2, &infraredSensor3,
                                           &infraredSensor4, &infraredSensor5, &infraredSensor6, &infraredSensor7};
        double left = 600, right = 600;
        for (int k = 0; k < 8; ++k) {
            left += LEFT[k] * sensors[k]->getValue();
            right += RIGHT[k] * sensors[k]->getValue();
        }
        leftSpeed = left * CM_PER_MOTOR_STEP;  // Enki clips them.
        rightSpeed = right * CM_PER_MOTOR_STEP;
        EPuck::controlStep(step);
    }
};

std::unique_ptr<Enki::World> crowd(int robots, bool has_turret) {
    const double side = 100 * std::sqrt(robots / 10.0);
    auto world = std::make_unique<Enki::World>(side, side);
    std::mt19937 draw(1);
    std::uniform_real_distribution<double> place(4, side - 4), angle(0, 2 * M_PI);
    while (static_cast<int>(world->objects.size()) < robots) {
        const Enki::Point here(place(draw), place(draw));
        bool is_free = true;
        for (const auto* other : world->objects) is_free = is_free && (here - other->pos).norm() > 8;
        if (!is_free) continue;
        auto* robot = new Vehicle(has_turret);  // The world deletes it.
        robot->pos = here;
        robot->angle = angle(draw);
        world->addObject(robot);
    }
    return world;
}

int main(int count, char** arguments) {
    const bool has_turret = count < 2 || std::string(arguments[1]) != "--sensors-only";
    std::map<int, std::unique_ptr<Enki::World>> worlds;
    for (std::string line; std::getline(std::cin, line);) {
        int robots = 0;
        if (std::sscanf(line.c_str(), "drive compiled %d", &robots) != 1 || robots > MOST_ROBOTS ||
            line != "drive compiled " + std::to_string(robots) + " 0 1") {
            std::cout << "- not measured with Enki" << std::endl;
            continue;
        }
        const int ticks = std::max(ROBOT_STEPS / robots, 3);
        auto& world = worlds[robots];
        const bool is_new = !world;
        if (is_new) world = crowd(robots, has_turret);
        for (int tick = 0; is_new && tick < ticks; ++tick) world->step(STEP);
        const auto start = std::chrono::steady_clock::now();
        const std::clock_t cpu = std::clock();
        for (int tick = 0; tick < ticks; ++tick) world->step(STEP);
        const double used = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
        const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
        std::cout << used << " " << wall.count() << " " << ticks * robots << " 0" << std::endl;
    }
}
