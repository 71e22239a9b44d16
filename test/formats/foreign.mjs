// SPDX-License-Identifier: MIT
// The npm package copc reads our LAS files.
//
// usage: node foreign.mjs FOREIGN DIR
//
// FOREIGN is the program of foreign.cpp, DIR a folder to work in. Exits with 77 (skipped) if copc is not
// found where Node.js looks for global packages or in NODE_PATH.
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { ok } from "node:assert/strict";

const require = createRequire(import.meta.url);
let Las;
try {
  ({ Las } = require("copc"));
} catch (error) {
  if (error.code !== "MODULE_NOT_FOUND") throw error;
  console.log("skipped: copc is not installed (npm install --global copc, and NODE_PATH set to its folder)");
  process.exit(77);
}

const [foreign, folder] = process.argv.slice(2);
execFileSync(foreign, ["write", folder]);

for (const k of [0, 1]) {
  const [names, ...rows] = readFileSync(`${folder}/${k}.txt`, "utf8")
    .trimEnd()
    .split("\n")
    .map((line) => line.trim().split(" "));
  const column = (name) => rows.map((row) => Number(row[names.indexOf(name)]));

  const file = readFileSync(`${folder}/las/000${k}.las`);
  const header = Las.Header.parse(file.subarray(0, 375));
  ok(header.majorVersion === 1 && header.minorVersion === 2, "version 1.2");
  ok(header.pointCount === rows.length, "number of points");
  const view = Las.View.create(file.subarray(header.pointDataOffset), header);
  const check = (dimension, name, tolerance) => {
    const get = view.getter(dimension);
    const wanted = column(name);
    const error = Math.max(...wanted.map((value, i) => Math.abs(get(i) - value)));
    ok(error <= tolerance, `${dimension}: off by ${error}`);
    console.log(`${dimension}: ${wanted.length} values, off by ${error}`);
  };
  // Half a step of 0.01 mm.
  ["X", "Y", "Z"].forEach((axis) => check(axis, axis.toLowerCase(), 0.5e-5 + 1e-13));
  check("GpsTime", "time", 0);
  check("ReturnNumber", "echo", 0);
  check("UserData", "flags", 0);
  ["x", "y", "z"].forEach((axis, i) => {
    ok(Math.abs(header.min[i] - Math.min(...column(axis))) < 0.5e-5 + 1e-13, `least ${axis}`);
    ok(Math.abs(header.max[i] - Math.max(...column(axis))) < 0.5e-5 + 1e-13, `largest ${axis}`);
  });
}
