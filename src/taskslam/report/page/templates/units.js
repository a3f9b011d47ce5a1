"use strict";
// Lengths and angles in the units that the page's switch shows, with the same digits as units.py.
const Units = (() => {
  const taskUnits = () => document.getElementById("unit-tu")?.checked ?? false;
  const taskNumber = (value) => value.toFixed(value < 0.1 ? 4 : value < 1 ? 3 : 2);
  // metres, radians: null where unknown; task: diameter in metres, field in degrees.
  const length = (metres, task) => {
    if (metres === null) return "–";
    if (taskUnits()) return `${taskNumber(metres / task.diameter)} D`;
    const cm = metres * 100;
    return `${cm.toFixed(cm >= 99.95 ? 0 : cm >= 9.995 ? 1 : 2)} cm`;
  };
  const angle = (radians, task) => {
    if (radians === null) return "–";
    const degrees = Math.abs(radians) * 180 / Math.PI;
    return taskUnits() ? `${taskNumber(degrees / task.field)} FoV` : `${degrees.toFixed(2)}°`;
  };
  return {taskUnits, length, angle};
})();
