"""What draws a film in a browser."""

SCRIPT = """function (script, film) {
  const read = (text, Kind) => new Kind(Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer);
  const places = read(film.places, Uint16Array), walls = read(film.walls, Uint16Array);
  const fields = film.fields.map(field => ({ ...field, values: read(field.values, Uint8Array) }));
  const starts = film.counts.reduce((sum, n) => [...sum, sum[sum.length - 1] + n], [0]);
  const box = script.previousElementSibling, make = (tag, set) =>
    box.appendChild(Object.assign(document.createElement(tag), set));
  const [wide, high] = film.extent, fit = Math.min(900 / wide, 700 / high);
  const canvas = make("canvas", { width: Math.ceil(wide * fit), height: Math.ceil(high * fit) });
  const bar = make("canvas", { width: canvas.width, height: 12 }), ends = make("p", {});
  const choice = make("select", { ariaLabel: "field" }), play = make("button", {
    textContent: "play" });
  const slider = make("input", { type: "range", min: 0, max: film.times.length - 1,
    ariaLabel: "time", value: film.times.length - 1 }), told = make("output", {});
  fields.forEach((field, k) => choice.add(new Option(field.label, k)));
  const pen = canvas.getContext("2d"), side = film.side * canvas.width;
  const share = u => u / 65535 * (1 + 2 * film.around) - film.around;
  const x = u => share(u) * canvas.width, y = u => (1 - share(u)) * canvas.height;
  const square = (u, v) => pen.fillRect(x(u) - side / 2, y(v) - side / 2, side, side);
  function draw() {
    const frame = +slider.value, field = fields[choice.value];
    pen.clearRect(0, 0, canvas.width, canvas.height);
    pen.fillStyle = "#9a9a9a";
    for (let k = 0; k < walls.length; k += 2) square(walls[k], walls[k + 1]);
    for (let k = starts[frame]; k < starts[frame + 1]; k++) {
      pen.fillStyle = field.colours[field.values[k]];
      square(places[2 * k], places[2 * k + 1]);
    }
    const ink = bar.getContext("2d");
    for (let k = 0; k < 255; k++) {
      ink.fillStyle = field.colours[k];
      ink.fillRect(k / 255 * bar.width, 0, bar.width / 255 + 1, bar.height);
    }
    const short = value => String(+value.toPrecision(3));
    ends.textContent = `${field.label}: ${short(field.low)} to ${short(field.high)}`;
    told.textContent = ` t = ${short(film.times[frame])} s`;
  }
  let timer = null;
  const stop = () => { clearInterval(timer); timer = null; play.textContent = "play"; };
  play.addEventListener("click", () => {
    if (timer !== null) return stop();
    play.textContent = "stop";
    timer = setInterval(() => {
      slider.value = (+slider.value + 1) % film.times.length;
      draw();
    }, 100);
  });
  slider.addEventListener("input", () => { stop(); draw(); });
  choice.addEventListener("change", draw);
  draw();
}"""
