// Reads a COPC file by copc.js (npm install copc), which decodes by laz-perf: points, bounds and classes, as JSON.
//
//     NODE_PATH=…/node_modules node benchmarks/copc_read.js FILE

const { Copc } = require('copc')

async function main(file) {
  const copc = await Copc.create(file)
  const { nodes } = await Copc.loadHierarchyPage(file, copc.info.rootHierarchyPage)
  const classes = {}
  let points = 0
  let outside = 0
  const [x0, y0, z0, x1] = copc.info.cube
  for (const [key, node] of Object.entries(nodes)) {
    const view = await Copc.loadPointDataView(file, copc, node)
    const [level, ...place] = key.split('-').map(Number)
    const edge = (x1 - x0) / 2 ** level
    const low = [x0, y0, z0].map((value, axis) => value + place[axis] * edge)
    const own = ['X', 'Y', 'Z'].map((name) => view.getter(name))
    const klass = view.getter('Classification')
    for (let index = 0; index < view.pointCount; index++) {
      const found = klass(index)
      classes[found] = (classes[found] || 0) + 1
      if (own.some((get, axis) => get(index) < low[axis] || get(index) > low[axis] + edge)) outside++
    }
    points += view.pointCount
  }
  const { pointCount, min, max } = copc.header
  console.log(JSON.stringify({ pointCount, points, outside, min, max, classes, nodes: Object.keys(nodes).length }))
}

main(process.argv[2])
