// Draws with the npm client over its WebSocket; the address is the argument.
const assert = require('node:assert')
const LineUs = require('@beardicus/line-us')

const arm = new LineUs({ url: process.argv[2] })

arm.on('error', (error) => {
  console.error(error)
  process.exit(1)
})

// Its coordinates have their origin at (650, 1000) of the arm, and y points down.
arm.on('connected', async () => {
  try {
    assert.strictEqual(arm.info.name, 'line-us')
    arm.moveTo({ x: 300, y: 1000 })
    arm.lineTo({ x: 600, y: 1000 })
    arm.lineTo({ x: 600, y: 700 })
    await arm.penUp()
    assert.deepStrictEqual(arm.coordinates, { x: 600, y: 700, z: 1000 })
    await arm.home()
    assert.deepStrictEqual(arm.coordinates, { x: 350, y: 0, z: 1000 })
    assert.strictEqual((await arm.getCapabilities()).MACHINENAME, 'line-us')
    assert.match((await arm.getDiagnostics()).Uptime, /^0d0h/)
    assert.strictEqual((await arm.setMachineName('robs-lineus')).MACHINENAME, 'robs-lineus')
    await assert.rejects(arm.listWifiNetworks(), /M587 is refused over the WebSocket/)
    await assert.rejects(arm.send({ g: 'G4' }), /unknown command 'G4'/)
    // Far out of reach: it goes to the edge, and the library goes on.
    await arm.to({ x: 5000, y: 1000 })
    assert.strictEqual(arm.coordinates.x, 1300)
    arm.disconnect()
  } catch (error) {
    console.error(error)
    process.exit(1)
  }
})

arm.on('disconnected', () => process.exit(0))
