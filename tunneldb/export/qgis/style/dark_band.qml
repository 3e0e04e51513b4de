<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22.0" styleCategories="AllStyleCategories" hasScaleBasedVisibilityFlag="0" minScale="0" maxScale="0" readOnly="0">
  <renderer-v2 type="categorizedSymbol" attr="decided" forceraster="0" enableorderby="0" symbollevels="0">
    <categories>
      <category symbol="0" value="false" type="bool" label="Wet or dirty: not decided" render="true"/>
      <category symbol="1" value="true" type="bool" label="Covered by leaks" render="true"/>
    </categories>
    <symbols>
      <symbol name="0" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="140,90,20,40"/>
            <Option type="QString" name="style" value="b_diagonal"/>
            <Option type="QString" name="outline_color" value="140,90,20,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.35"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="1" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="140,90,20,40"/>
            <Option type="QString" name="style" value="no"/>
            <Option type="QString" name="outline_color" value="140,90,20,255"/>
            <Option type="QString" name="outline_style" value="dash"/>
            <Option type="QString" name="outline_width" value="0.35"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
  <fieldConfiguration>
    <field name="id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="survey_id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="survey" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="km" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="chainage_from" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="chainage_to" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="label_from" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="label_to" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="arc_from" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="arc_to" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="darkening" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="area" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="decided" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <aliases>
    <alias index="0" field="id" name="Band key"/>
    <alias index="1" field="survey_id" name="Survey key"/>
    <alias index="2" field="survey" name="Survey"/>
    <alias index="3" field="km" name="Kilometre"/>
    <alias index="4" field="chainage_from" name="Chainage from (m)"/>
    <alias index="5" field="chainage_to" name="Chainage to (m)"/>
    <alias index="6" field="label_from" name="From"/>
    <alias index="7" field="label_to" name="To"/>
    <alias index="8" field="arc_from" name="Least arc (m)"/>
    <alias index="9" field="arc_to" name="Greatest arc (m)"/>
    <alias index="10" field="darkening" name="Darkening (dB)"/>
    <alias index="11" field="area" name="Area (m²)"/>
    <alias index="12" field="decided" name="Covered by leaks"/>
  </aliases>
  <previewExpression>"label_from"</previewExpression>
  <mapTip>&lt;b&gt;[% replace("label_from", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %] – [% replace("label_to", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %]&lt;/b&gt;: [% if("decided", 'covered by leaks', 'wet or dirty, not decided') %]&lt;br&gt;[% format_number("area", 1) %] m², [% format_number("darkening", 1) %] dB darker than beside it</mapTip>
  <layerGeometryType>2</layerGeometryType>
</qgis>
