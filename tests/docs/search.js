// What the search of a built site finds, run as a page that is opened from a folder runs it:
// node search.js SITE WORDS... prints a JSON list of places for each.
const fs = require("fs"), path = require("path"), vm = require("vm");

const [site, ...words] = process.argv.slice(2);
const folder = path.join(site, "assets/javascripts/workers");
const script = fs.readdirSync(folder).find(name => /^search.*\.js$/.test(name));
const answers = [], world = { console, URL, location: { href: "file:///" } };
world.self = world.window = world;
world.addEventListener = (_, listener) => { world.heard = listener; };
world.postMessage = message => answers.push(message);
vm.createContext(world);
for (const file of [path.join(site, "search/search_index.js"), path.join(folder, script)])
  vm.runInContext(fs.readFileSync(file, "utf8"), world);

async function ask(message) {
  await world.heard({ data: message });
  while (!answers.length) await new Promise(resolve => setTimeout(resolve, 1));
  return answers.shift().data;
}

(async () => {
  await ask({ type: 0, data: { ...world.__index, options: { suggest: false } } });
  for (const word of words) {
    const found = await ask({ type: 2, data: word });
    console.log(JSON.stringify(found.items.flat().map(item => item.location)));
  }
})();
